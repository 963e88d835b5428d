//! Files that `quietcut identify --out` writes: case, report and picture.

use std::path::{Path, PathBuf};

use maud::html;

use super::answer::IdentifyOutput;
use super::comments;
use crate::cli::Error;
use crate::report::page::{figure, page};

/// True if one of the files to write is a report or a picture.
pub(super) fn wants_picture(out: &[PathBuf]) -> bool {
    out.iter()
        .any(|path| matches!(crate::file::ending(path).as_str(), "html" | "svg"))
}

/// First case file among the files to write.
pub(super) fn case_file(out: &[PathBuf]) -> Option<&Path> {
    out.iter()
        .map(PathBuf::as_path)
        .find(|path| crate::file::ending(path) == "toml")
}

/// Writes the files of `--out`: the identified case, with the sections of the case `other`, a report of the lines `text`, or the picture. The
/// content of all files is known before the first is written.
///
/// # Errors
/// The method gives no case or no picture, or a file cannot be written.
pub(super) fn write(
    out: &[PathBuf],
    answer: &mut IdentifyOutput,
    other: Option<&toml::Table>,
    text: &str,
) -> Result<(), Error> {
    let contents = out
        .iter()
        .map(|path| content(path, answer, other, text))
        .collect::<Result<Vec<_>, _>>()?;
    for (path, content) in out.iter().zip(contents) {
        crate::file::write(path, content.as_bytes())?;
    }
    answer.case = case_file(out).map(Path::to_path_buf);
    answer.out = out.to_vec();
    Ok(())
}

fn content(
    path: &Path,
    answer: &IdentifyOutput,
    other: Option<&toml::Table>,
    text: &str,
) -> Result<String, Error> {
    match crate::file::ending(path).as_str() {
        "html" => Ok(report(answer, text)),
        "csv" => answer.csv().ok_or_else(|| {
            Error::input(format!(
                "--out {}: --method {} has no table; toml or html is needed",
                path.display(),
                answer.method
            ))
        }),
        "svg" => answer.picture.clone().map(|(svg, _)| svg).ok_or_else(|| {
            Error::input(format!(
                "--out {}: --method {} has no picture; toml or html is needed",
                path.display(),
                answer.method
            ))
        }),
        _ => {
            let text = answer.case(path, other)?;
            Ok(if path.exists() {
                comments::kept(&crate::file::read_text(path)?, &text)
            } else {
                text
            })
        }
    }
}

/// Page with the picture, the lines of the text output and the warnings.
fn report(answer: &IdentifyOutput, text: &str) -> String {
    let title = format!("Identified by {}", answer.method);
    let body = html! {
        h1 { (title) }
        @if let Some((svg, caption)) = &answer.picture { (figure(svg, caption)) }
        ul { @for line in text.lines() { li { (line) } } }
        @if !answer.warnings.is_empty() {
            h2 { "Warnings" }
            ul { @for warning in &answer.warnings { li { (warning) } } }
        }
    };
    page(&title, &body)
}
