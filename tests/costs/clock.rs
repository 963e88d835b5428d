//! Processor time, and the loop that it is compared with.

use std::hint::black_box;

use nix::sys::resource::{UsageWho, getrusage};

/// Multiplications in the fixed loop, each of which waits for the one before.
const STEPS: u32 = 30_000_000;

/// User time of this process or of its children so far, s.
fn user_s(who: UsageWho) -> f64 {
    let time = getrusage(who).unwrap().user_time();
    time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64
}

/// User time that the children of this process take for some work, s.
pub(crate) fn user_time_of(work: impl FnOnce()) -> f64 {
    let before = user_s(UsageWho::RUSAGE_CHILDREN);
    work();
    user_s(UsageWho::RUSAGE_CHILDREN) - before
}

/// User time of the logistic map x → 3.7 x (1 − x): a chain of floating-point operations in which nothing runs side by side.
pub(crate) fn fixed_loop_s() -> f64 {
    let before = user_s(UsageWho::RUSAGE_SELF);
    let mut x = black_box(0.3_f64);
    for _ in 0..STEPS {
        x = 3.7 * x * (1.0 - x);
    }
    black_box(x);
    user_s(UsageWho::RUSAGE_SELF) - before
}
