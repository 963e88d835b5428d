//! HTML page of a report: one file that contains style and pictures.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Style sheet of every page.
const STYLE: &str = "
body { font: 16px/1.5 system-ui, sans-serif; color: #262b33; background: #f4f5f7; margin: 0; }
main { max-width: 1000px; margin: 0 auto; padding: 24px 28px 60px; background: #fff; }
h1 { font-size: 1.7em; margin: 0.4em 0 0.2em; }
h2 { font-size: 1.25em; margin: 1.8em 0 0.4em; border-bottom: 2px solid #dde0e4; padding-bottom: 0.15em; }
figure { margin: 1em 0; }
figure svg { max-width: 100%; height: auto; display: block; }
figcaption { color: #5a626e; font-size: 0.92em; margin-top: 0.3em; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 16px; }
@media (max-width: 760px) { .pair { grid-template-columns: 1fr; } }
table { border-collapse: collapse; margin: 0.8em 0; }
th, td { text-align: left; padding: 0.3em 1.1em 0.3em 0; border-bottom: 1px solid #dde0e4; vertical-align: top; }
.chatter { color: #c22f2f; font-weight: 600; }
.quiet { color: #1b864e; font-weight: 600; }
footer { color: #5a626e; font-size: 0.9em; margin-top: 3em; }
";

/// Renders a complete HTML page around `body`; it needs no other file and no network if `body` needs none.
pub fn page(title: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (body) } }
        }
    }
    .into_string()
}

/// HTML figure: SVG picture with its caption.
pub fn figure(svg: &str, caption: &str) -> Markup {
    html! {
        figure {
            (PreEscaped(svg))
            figcaption { (caption) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_needs_nothing_else_and_escapes_text() {
        let body = html! { p { "a < b" } (figure("<svg></svg>", "1 > 0")) };
        let page = page("quietcut", &body);
        assert!(page.starts_with("<!DOCTYPE html>"));
        assert!(page.contains("a &lt; b") && page.contains("<svg></svg>") && page.contains("1 &gt; 0"));
        for outside in ["<script", "<link", "src=", "url(", "http"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }
}
