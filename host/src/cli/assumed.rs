//! Assumptions behind limits, as text and in reports.

use std::fmt::Write;

use maud::{Markup, html};

/// One line of text for each assumption, each after a line break.
pub(super) fn lines(assumed: &[String]) -> String {
    let mut text = String::new();
    for sentence in assumed {
        // Writing to a String cannot fail.
        let _ = write!(text, "\nassumed: {sentence}");
    }
    text
}

/// Section of a page with the assumptions; nothing without any.
pub(super) fn section(assumed: &[String]) -> Markup {
    html! {
        @if !assumed.is_empty() {
            h2 { "Assumed" }
            ul { @for sentence in assumed { li { (sentence) } } }
        }
    }
}
