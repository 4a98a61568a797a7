//! Code that must not compile is answered with a sentence of ours, and its corrected twin compiles.
//!
//! One small package that depends on this one by path holds every case: a bad program in `src/bin`, its twin in
//! `examples`. Only our sentence is searched for, since rustc's own words change with its releases.

use parops::testing::Promise;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs};

struct Case {
    name: &'static str,
    /// What the user must be told.
    sentence: &'static str,
    /// Items that both programs share.
    shared: &'static str,
    /// The body of `main` that must not compile.
    bad: &'static str,
    /// The corrected body, which must.
    good: &'static str,
}

const UNEQUAL: &str = "a sum of differential operators must have one degree: its terms have unequal degree";
const THREE_EXPONENTS: &str = "this multi-index does not have 3 exponents, so it is no derivative in 3 dimensions";
const TAKES: &str = "fn takes(_: impl Operator<3>) {}";

const IN_TWO: &str = "is no provider of neighbors in 2 dimensions";
const OPERATOR_OF_TWO: &str = "
            fn pse() -> Pse<Exchange<2>> {
                Pse::new(Laplacian::<2>, 2, Epsilon::global(0.1).unwrap(), &Volumes::equal(0.01).unwrap()).unwrap()
            }
            fn sph() -> Sph<Gaussian<2>, 2> {
                let volumes = Volumes::equal(0.01).unwrap();
                Sph::new(Laplacian::<2>, Gaussian::<2>::new(), Epsilon::global(0.1).unwrap(), &volumes).unwrap()
            }
            fn cells<const D: usize>() -> CellList<D> {
                let particles = Particles::new(vec![[0.0; D]]).unwrap();
                CellList::build(&particles, &Domain::open(), Cutoff(0.6)).unwrap()
            }";

const CASES: &[Case] = &[
    Case {
        name: "sum_of_unequal_degree",
        sentence: UNEQUAL,
        shared: "",
        bad: "let _ = D2::<2, 0>::default() + D2::<1, 0>::default();",
        good: "let _ = D2::<2, 0>::default() + D2::<1, 1>::default();",
    },
    Case {
        name: "named_sum_of_unequal_degree",
        sentence: UNEQUAL,
        shared: "",
        bad: "let _ = std::mem::size_of::<Plus<D2<2, 0>, D2<1, 0>>>();",
        good: "let _ = std::mem::size_of::<Plus<D2<2, 0>, D2<0, 2>>>();",
    },
    Case {
        name: "nested_sum_of_unequal_degree",
        sentence: UNEQUAL,
        shared: "",
        bad: "let _ = Laplacian::<2> + D2::<1, 1>::default() + 2.0 * D2::<1, 0>::default();",
        good: "let _ = Laplacian::<2> + D2::<1, 1>::default() + 2.0 * D2::<2, 0>::default();",
    },
    Case {
        name: "difference_of_unequal_degree",
        sentence: UNEQUAL,
        shared: "",
        bad: "let _ = 2.0 * Laplacian::<2> - Gradient::<2>;",
        good: "let _ = 2.0 * Gradient::<2> - Gradient::<2>;",
    },
    Case {
        name: "derivative_of_another_dimension",
        sentence: THREE_EXPONENTS,
        shared: TAKES,
        bad: "takes(D2::<2, 0>::default());",
        good: "takes(D3::<2, 0, 0>::default());",
    },
    Case {
        name: "sum_across_dimensions",
        sentence: THREE_EXPONENTS,
        shared: TAKES,
        bad: "takes(Laplacian::<3> + D2::<2, 0>::default());",
        good: "takes(Laplacian::<3> + D3::<2, 0, 0>::default());",
    },
    Case {
        name: "value_of_another_dimension",
        sentence: THREE_EXPONENTS,
        shared: "fn exponents(_: MultiIndex<3>) {}",
        bad: "exponents(D2::<2, 0>::default().into());",
        good: "exponents(D3::<2, 0, 0>::default().into());",
    },
    Case {
        name: "laplacian_of_another_dimension",
        sentence: "is no differential operator in 3 dimensions",
        shared: TAKES,
        bad: "takes(Laplacian::<2>);",
        good: "takes(Laplacian::<3>);",
    },
    Case {
        name: "provider_of_another_dimension",
        sentence: "`Nobody<3>` is no provider of neighbors in 2 dimensions",
        shared: "
            struct Nobody<const D: usize>;
            impl Neighbors<2> for Nobody<2> {
                fn targets(&self) -> usize { 0 }
                fn sources(&self) -> usize { 0 }
                fn center(&self, _: usize) -> Option<usize> { None }
                fn cutoff(&self, _: usize) -> f64 { 1.0 }
                fn reach(&self) -> f64 { 1.0 }
                fn generation(&self) -> u64 { 0 }
                fn for_each(&self, _: usize, _: f64, _: impl FnMut(Neighbor<2>)) {}
            }
            fn takes(_: &impl Neighbors<2>) {}",
        bad: "takes(&Nobody::<3>);",
        good: "takes(&Nobody::<2>);",
    },
    Case {
        name: "rows_of_another_dimension",
        sentence: "Exchange<2>` is no kernel in 3 dimensions",
        shared: OPERATOR_OF_TWO,
        bad: "let _ = Rows::<[f64; 1]>::assemble::<3, _, _>(&pse(), &cells::<3>());",
        good: "let _ = Rows::<[f64; 1]>::assemble::<2, _, _>(&pse(), &cells::<2>());",
    },
    Case {
        name: "smoothing_kernel_of_another_dimension",
        sentence: "is no smoothing kernel in 3 dimensions",
        shared: "fn takes(_: impl SmoothingKernel<f64, 3>) {}",
        bad: "takes(Gaussian::<2>::new());",
        good: "takes(Gaussian::<3>::new());",
    },
    Case {
        name: "rows_over_a_provider_of_another_dimension",
        sentence: IN_TWO,
        shared: OPERATOR_OF_TWO,
        bad: "let _ = Rows::<[f64; 1]>::assemble(&pse(), &cells::<3>());",
        good: "let _ = Rows::<[f64; 1]>::assemble(&pse(), &cells::<2>());",
    },
    Case {
        name: "assembled_over_a_provider_of_another_dimension",
        sentence: IN_TWO,
        shared: OPERATOR_OF_TWO,
        bad: "let _ = pse().assemble(&cells::<3>());",
        good: "let _ = pse().assemble(&cells::<2>());",
    },
    Case {
        name: "matrix_free_over_a_provider_of_another_dimension",
        sentence: IN_TWO,
        shared: OPERATOR_OF_TWO,
        bad: "let _ = pse().matrix_free(&cells::<3>()).is_ok();",
        good: "let _ = pse().matrix_free(&cells::<2>()).is_ok();",
    },
    Case {
        name: "sph_over_a_provider_of_another_dimension",
        sentence: IN_TWO,
        shared: OPERATOR_OF_TWO,
        bad: "let _ = sph().assemble(&cells::<3>());",
        good: "let _ = sph().assemble(&cells::<2>());",
    },
];

/// A package of its own, with its own target folder and the versions this package was resolved to, so that it needs
/// no network.
struct Package(PathBuf);

impl Package {
    fn write(cases: &[Case]) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let package = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compile_fail");
        for folder in ["src/bin", "examples"] {
            // A case that was renamed or dropped leaves no program behind.
            let _ = fs::remove_dir_all(package.join(folder));
            fs::create_dir_all(package.join(folder)).unwrap();
        }
        let path = root.to_str().unwrap().replace('\\', "/");
        let manifest = format!(
            "[package]\nname = \"refused\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
             [dependencies]\nparops = {{ path = \"{path}\" }}\n\n[workspace]\n"
        );
        fs::write(package.join("Cargo.toml"), manifest).unwrap();
        fs::copy(root.join("Cargo.lock"), package.join("Cargo.lock")).unwrap();
        for case in cases {
            for (folder, body) in [("src/bin", case.bad), ("examples", case.good)] {
                let program =
                    format!("#![allow(unused)]\nuse parops::*;\n{}\n\nfn main() {{\n    {body}\n}}\n", case.shared);
                fs::write(package.join(folder).join(case.name).with_extension("rs"), program).unwrap();
            }
        }
        Self(package)
    }

    fn check(&self, targets: &[&str]) -> Output {
        Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .args(["check", "--offline", "--color", "never", "--target-dir"])
            .arg(self.0.join("target"))
            .args(targets)
            .current_dir(&self.0)
            .output()
            .unwrap()
    }
}

/// One test: the cases share a target folder, which a second cargo would wait for.
#[test]
fn wrong_programs_are_refused_in_our_words_and_their_twins_compile() {
    let package = Package::write(CASES);

    let twins = package.check(&["--examples", "--keep-going"]);
    let stderr = String::from_utf8_lossy(&twins.stderr);
    assert!(twins.status.success(), "a corrected program does not compile:\n{stderr}");

    let mut failures = Vec::new();
    for case in CASES {
        let output = package.check(&["--bin", case.name]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        if output.status.success() {
            failures.push(format!("{} compiles", case.name));
        } else if !stderr.contains(case.sentence) {
            failures.push(format!("{} is refused without the sentence {:?}:\n{stderr}", case.name, case.sentence));
        }
    }
    Promise::new("Input", "sums of unequal degree and parts of another dimension do not compile, and are told why")
        .case(failures.join("\n\n"))
        .holds(failures.is_empty());
}
