//! What the times were measured on.

/// Facts of a page: version of the crate and how it was built, operating system, processor where the system names it,
/// and how many threads it offers.
pub fn machine() -> Vec<(&'static str, String)> {
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    let lanes = if cfg!(target_feature = "avx2") { ", built for AVX2" } else { "" };
    let threads = std::thread::available_parallelism().map_or("unknown".to_string(), |count| count.to_string());
    vec![
        ("parops", format!("{}, {build} build", env!("CARGO_PKG_VERSION"))),
        ("system", format!("{} on {}{lanes}", std::env::consts::OS, std::env::consts::ARCH)),
        ("processor", processor().unwrap_or_else(|| "unknown".to_string())),
        ("threads offered", threads),
    ]
}

/// Its name where the system keeps it in `/proc/cpuinfo`.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}
