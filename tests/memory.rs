//! How much memory building rows takes: the bytes in use at the worst moment, counted by the allocator.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use parops::{DcPse, Domain, Laplacian, Nearest, Particles, testing::Promise};

struct Measuring;

static USED: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn taken(bytes: usize) {
    PEAK.fetch_max(USED.fetch_add(bytes, Relaxed) + bytes, Relaxed);
}

// SAFETY: every call is handed to the system allocator unchanged.
unsafe impl GlobalAlloc for Measuring {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        taken(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Measuring = Measuring;

/// The most bytes in use while `f` runs, beyond those before it.
fn peak<R>(f: impl FnOnce() -> R) -> (R, usize) {
    let before = USED.load(Relaxed);
    PEAK.store(before, Relaxed);
    let result = f();
    (result, PEAK.load(Relaxed) - before)
}

// One test alone in its file: what another thread allocates would be counted too.
#[test]
fn assembling_takes_the_rows_and_a_fifth() -> Result<(), parops::Error> {
    assert!(peak(|| vec![0_u8; 1000]).1 >= 1000);
    let particles = Particles::jittered([0.0; 3], [1.0; 3], [22; 3], 0.3, 1)?;
    let dcpse = DcPse::<Laplacian<3>, 2>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors::<3>()?)?;
    let (rows, bytes) = peak(|| dcpse.assemble(&neighbors));
    let rows = rows?;
    let ratio = bytes as f64 / rows.bytes() as f64;
    // Rows are counted first: no list is stored, and no vector is doubled.
    assert!(rows.bytes() > 22 * 22 * 22 * 38 * 12, "{} bytes", rows.bytes());
    Promise::new("Allocations", "peak of assembling over the bytes of the rows").at_most(1.2, ratio);
    Ok(())
}
