//! Progress on a terminal: a line on standard error while a verb computes.
//!
//! The line is gone before anything else is printed. Without a terminal nothing is shown.

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// The line moves this often, so that one sees that the command works.
const TICK: Duration = Duration::from_millis(200);

/// The line that is shown.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Shows that the command is `doing` something, and for how long, until [`clear`].
pub(super) fn show(doing: &'static str) {
    let spinner = bar(None, "{spinner} {msg} {elapsed}");
    spinner.set_message(doing);
    let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(before) = shown.replace(spinner) {
        before.finish_and_clear();
    }
}

/// Takes the line away.
pub(super) fn clear() {
    let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(spinner) = shown.take() {
        spinner.finish_and_clear();
    }
}

/// A bar of `steps` on standard error, or of an unknown number; hidden where that is no terminal.
pub(super) fn bar(steps: Option<u64>, template: &str) -> ProgressBar {
    let is_terminal = std::io::stderr().is_terminal();
    let target = if is_terminal {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(steps, target);
    if is_terminal {
        bar.enable_steady_tick(TICK);
    }
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
