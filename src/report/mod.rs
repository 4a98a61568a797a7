//! Error against run time: samples of methods at work, and what they say about which method to take.
//!
//! A [`Sample`] is one method on one set: what it was, how wrong, how long each phase took, how much memory. [`measure`]
//! makes one from a closure that is run several times; a [`Table`] holds them, adds observed orders, finds the Pareto
//! front and the cheapest method of every [`Task`], and goes to CSV and back; a [`Page`] shows it all in one HTML file.
//!
//! ```
//! use parops::report::{Phase, Repeats, Sample, Table, measure};
//! use parops::{Apply, DcPse, Domain, Laplacian, Nearest, Particles};
//!
//! let mut table = Table::default();
//! for side in [12, 24] {
//!     let particles = Particles::jittered([0.0; 2], [1.0; 2], [side; 2], 0.3, 1)?;
//!     let f: Vec<f64> = particles.points().iter().map(|x| (x[0] + 2.0 * x[1]).sin()).collect();
//!     let what = Sample { h: 1.0 / side as f64, n: f.len(), ..Sample::new("laplacian", 2, "jittered", "DC-PSE", 2) };
//!     table.push(measure(what, Repeats::default(), None, |watch, sample| {
//!         let dcpse = DcPse::<Laplacian<2>, 2>::new();
//!         let nearest = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
//!         let rows = watch.time(Phase::Build, || dcpse.assemble(&nearest))?;
//!         let mut lap = vec![0.0; f.len()];
//!         watch.time(Phase::Apply, || rows.apply(&f, &mut lap))?;
//!         sample.errors(lap.iter().copied(), f.iter().map(|f| -5.0 * f));
//!         Ok(())
//!     })?)?;
//! }
//! assert!(table.samples()[1].observed_order.is_some_and(|order| order > 1.5));
//! assert_eq!(table.tasks()[0].cheapest(1e-1).map(|best| best.label()), Some("DC-PSE 2".to_string()));
//! # parops::Result::Ok(())
//! ```

mod csv;
mod machine;
mod measure;
mod page;
mod sample;
mod stopwatch;
mod table;
mod task;

pub use csv::HEADER;
pub use machine::machine;
pub use measure::{PeakMeter, Repeats, measure};
pub use page::Page;
pub use sample::Sample;
pub use stopwatch::{Phase, Seconds, Stopwatch};
pub use table::{Table, observed_order};
pub use task::{TARGETS, Task, pareto_front};
