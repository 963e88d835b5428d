//! Progress of a verb on a terminal: a line on standard error while it computes.
//!
//! The line that `show` draws is removed before results or log messages are printed. Without a terminal nothing is
//! shown.

use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Period of the animation of the progress line on the terminal: a choice, short enough to show that the command works.
const TICK: Duration = Duration::from_millis(200);

/// The progress line that [`show`] has drawn and [`clear`] has not removed; `None` if there is none.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Shows a progress line with the activity `doing` and the elapsed time, until [`clear`].
pub(super) fn show(doing: &'static str) {
    let spinner = bar(None, "{spinner} {msg} {elapsed}");
    spinner.set_message(doing);
    let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(before) = shown.replace(spinner) {
        before.finish_and_clear();
    }
}

/// Removes the progress line.
pub(super) fn clear() {
    let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(spinner) = shown.take() {
        spinner.finish_and_clear();
    }
}

/// Shows a progress bar of `steps` steps on standard error, or a spinner if the number of steps is unknown; it is
/// hidden if standard error is no terminal.
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
