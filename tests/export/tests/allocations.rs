//! Set, Get, doStep and derivatives allocate nothing, counted by the allocator itself.

#![allow(unsafe_code, reason = "a counting allocator")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use export_tests::Named;
use models::suspension::DoubleWishbone;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: hands everything to the system's allocator; counting touches a thread-local Cell only.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: same contract.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn steps_values_and_derivatives_do_not_allocate() {
    for settings in [
        &[][..],
        &[("scene.motion", 2.0), ("use.tie", 1.0)],
        &[("closure.kind", 2.0), ("closure.k", 1e5), ("closure.c", 100.0)],
    ] {
        for method in [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
            let mut fmu = Named::<DoubleWishbone>::default();
            for (name, value) in settings {
                fmu.set(name, *value).expect("setting");
            }
            fmu.set("solver.method", method).expect("method");
            fmu.initialize().expect("start");
            let reads =
                ["P.r.x", "P.a.z", "A.F.x", "energy.kinetic", "loop.condition"].map(|n| fmu.reference(n));
            let (force, damping) = (fmu.reference("P.F.z"), fmu.reference("strut.c"));
            let mut values = [0.0; 5];
            let before = COUNT.with(Cell::get);
            for i in 0..10_u32 {
                let t = fmu.instance.time();
                fmu.instance
                    .set(&[force], "Float64", |_| true, |_| f64::from(i))
                    .expect("input");
                fmu.instance
                    .set(&[damping], "Float64", |_| true, |_| 1000.0 + f64::from(i))
                    .expect("tunable");
                fmu.instance.do_step(t, 0.01).expect("step");
                fmu.instance.get_float64(&reads, &mut values).expect("outputs");
                fmu.instance
                    .directional_derivative(&reads, &[force], &[1.0], &mut values)
                    .expect("derivative");
            }
            let allocated = COUNT.with(Cell::get) - before;
            assert_eq!(allocated, 0, "{settings:?}, method {method}");
        }
    }
}
