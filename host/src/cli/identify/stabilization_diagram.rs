//! Stabilization diagram of `--method modes` as a file.

use std::path::Path;

use maud::html;

use super::Error;
use crate::identify::modes::ModalModel;
use crate::report::page::{figure, page};

/// Format of a stabilization diagram.
#[derive(Clone, Copy)]
pub(super) enum ChartFormat {
    Svg,
    Html,
}

/// Format of the file of `--stabilization`.
///
/// # Errors
/// The file ends in neither svg nor html.
pub(super) fn ending(path: &Path) -> Result<ChartFormat, Error> {
    match crate::file::ending(path).as_str() {
        "svg" => Ok(ChartFormat::Svg),
        "html" => Ok(ChartFormat::Html),
        other => Err(Error::input(format!(
            "--stabilization {}: it ends in \"{other}\"; svg or html is needed",
            path.display()
        ))),
    }
}

/// Title of the diagram.
pub(super) const TITLE: &str = "Stabilization diagram";
/// Caption of the diagram in a page.
pub(super) const CAPTION: &str = "Poles whose frequency, damping and mode shape stay constant as the model order increases are modes. Below: measured \
                       receptances and their fit.";

/// Writes the diagram `svg` by itself, or in a page with the rejected poles.
pub(super) fn write_diagram(path: &Path, svg: &str, model: &ModalModel) -> Result<(), Error> {
    let text = match ending(path)? {
        ChartFormat::Svg => svg.to_owned(),
        ChartFormat::Html => {
            let body = html! {
                h1 { (TITLE) }
                (figure(svg, CAPTION))
                table {
                    tr { th { "frequency" } th { "damping ratio" } th { "reason for rejection" } }
                    @for pole in &model.rejected {
                        tr {
                            td { (format!("{:.3} Hz", pole.frequency_hz)) }
                            td { (format!("{:.4}", pole.damping_ratio)) }
                            td { (pole.why) }
                        }
                    }
                }
            };
            page(TITLE, &body)
        }
    };
    Ok(crate::file::write(path, text.as_bytes())?)
}
