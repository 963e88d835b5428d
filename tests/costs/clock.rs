//! Processor time of a command, and of the loop with which it is compared.

use std::hint::black_box;

use nix::sys::resource::{UsageWho, getrusage};

/// Number of steps of the fixed loop. Each step depends on the result of the preceding one.
const STEPS: u32 = 30_000_000;

/// User time of this process, or of its ended children, since the start, s.
fn user_s(who: UsageWho) -> f64 {
    let time = getrusage(who).unwrap().user_time();
    time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64
}

/// User time of the child processes that `work` runs, s.
pub(crate) fn user_time_of(work: impl FnOnce()) -> f64 {
    let before = user_s(UsageWho::RUSAGE_CHILDREN);
    work();
    user_s(UsageWho::RUSAGE_CHILDREN) - before
}

/// User time of the iteration x → 3.7 x (1 − x): dependent floating-point operations, which a processor cannot overlap.
pub(crate) fn fixed_loop_s() -> f64 {
    let before = user_s(UsageWho::RUSAGE_SELF);
    let mut x = black_box(0.3_f64);
    for _ in 0..STEPS {
        x = 3.7 * x * (1.0 - x);
    }
    black_box(x);
    user_s(UsageWho::RUSAGE_SELF) - before
}
