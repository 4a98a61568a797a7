//! Nothing allocates where nothing should: a counting allocator under the whole test.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use parops::{Euler, Leapfrog, Rk4, Stepper};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    // While a thread ends its counter may be gone; nothing is measured then.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is handed to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often this thread allocates in `f`.
fn allocations(f: impl FnOnce()) -> usize {
    let before = COUNT.get();
    f();
    COUNT.get() - before
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![0_u8; 100]))), 1);
    assert_eq!(allocations(|| {}), 0);
}

#[test]
fn steps_after_the_first_allocate_nothing() {
    let steppers: [Box<dyn Stepper<Vec<[f64; 2]>>>; 3] =
        [Box::new(Euler::new()), Box::new(Rk4::new()), Box::new(Leapfrog::new())];
    for mut stepper in steppers {
        let mut u = vec![[1.0, 0.0]; 1000];
        let mut steps = |stepper: &mut dyn Stepper<_>, start: f64, dt: f64, n: u32| {
            for step in 0..n {
                let t = start + f64::from(step) * dt;
                let rotate = &mut |_: f64, u: &Vec<[f64; 2]>, du: &mut Vec<[f64; 2]>| {
                    du.iter_mut().zip(u).for_each(|(du, u)| *du = [-u[1], u[0]]);
                    Ok(())
                };
                stepper.step(t, dt, &mut u, rotate).unwrap();
            }
        };
        assert!(allocations(|| steps(&mut *stepper, 0.0, 0.1, 1)) > 0);
        assert_eq!(allocations(|| steps(&mut *stepper, 0.1, 0.1, 10)), 0);
        stepper.reset();
        assert_eq!(allocations(|| steps(&mut *stepper, 0.0, 0.05, 10)), 0);
    }
}
