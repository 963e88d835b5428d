//! The question for the speed range of the spindle, for a case that has no section `[limits]`.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::Path;

use super::range::lowest_and_highest_rpm;
use super::{Error, Output, progress};
use crate::case::{Case, CaseError};
use crate::file;

/// Asks for the lowest and highest speed of the spindle if the case has no `[limits]`, and keeps the answer in the case file, below
/// its other sections. It asks only where standard input, output and error are terminals and no JSON is wanted; an empty line
/// leaves the case as it is.
///
/// # Errors
/// The terminal fails, or the case file cannot be read or written.
pub(super) fn ask(case: &mut Case, output: Output) -> Result<(), Error> {
    let is_interactive =
        io::stdin().is_terminal() && io::stdout().is_terminal() && io::stderr().is_terminal();
    if case.limits.is_some() || output.is_json() || !is_interactive {
        return Ok(());
    }
    progress::clear();
    let path = case.path.clone();
    let before = file::read_text(&path)?;
    let (mut input, mut terminal) = (io::stdin().lock(), io::stderr());
    if let Some((text, answered)) = asked(&path, &before, &mut input, &mut terminal).map_err(Error::other)? {
        file::write(&path, text.as_bytes())?;
        eprintln!("  kept under [limits] in {}", path.display());
        case.limits = answered.limits;
    }
    Ok(())
}

/// Text of the case file with the answer, and the case that it is; `None` after an empty line, or if the input ends. A wrong answer is
/// asked for again.
fn asked(
    path: &Path,
    before: &str,
    input: &mut impl BufRead,
    terminal: &mut impl Write,
) -> io::Result<Option<(String, Case)>> {
    writeln!(
        terminal,
        "{} has no section [limits]: no speed can be kept from being proposed.",
        path.display()
    )?;
    loop {
        write!(
            terminal,
            "Lowest and highest speed of the spindle in rev/min, FIRST:LAST (empty: every speed is taken as possible): "
        )?;
        terminal.flush()?;
        let mut line = String::new();
        if input.read_line(&mut line)? == 0 || line.trim().is_empty() {
            return Ok(None);
        }
        match with_limits(path, before, line.trim()) {
            Ok(kept) => return Ok(Some(kept)),
            Err(reason) => writeln!(terminal, "  {reason}")?,
        }
    }
}

fn with_limits(path: &Path, before: &str, answer: &str) -> Result<(String, Case), String> {
    let [low, high] = lowest_and_highest_rpm(answer)?;
    let text = format!(
        "{}\n\n[limits]\nrpm_min = {low:?}\nrpm_max = {high:?}\n",
        before.trim_end()
    );
    let case = Case::parse(path, &text).map_err(|error: CaseError| error.to_string())?;
    Ok((text, case))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "# My mill.\n[tool]\nteeth = 2 # carbide\nedge_angle_deg = 90.0\n";

    fn answered(lines: &str) -> (Option<(String, Case)>, String) {
        let mut said = Vec::new();
        let found = asked(Path::new("case.toml"), CASE, &mut lines.as_bytes(), &mut said).unwrap();
        (found, String::from_utf8(said).unwrap())
    }

    #[test]
    fn the_answer_stands_in_the_case_and_its_comments_stay() {
        let (found, said) = answered("fast\n12000:600\n600:12000\n");
        let (text, case) = found.unwrap();
        let limits = case.limits.unwrap();
        assert_eq!((limits.rpm_min, limits.rpm_max), (600.0, 12_000.0));
        assert!(text.starts_with(CASE.trim_end()), "{text}");
        // Both wrong answers are named, and asked for again.
        assert_eq!(said.matches("FIRST:LAST").count(), 3, "{said}");
        assert!(said.contains("`fast`") && said.contains("12000"), "{said}");
        assert!(said.contains("such as 600:12000"), "{said}");
    }

    #[test]
    fn an_empty_line_and_the_end_of_the_input_change_nothing() {
        for lines in ["\n", "", "fast\n"] {
            assert!(answered(lines).0.is_none(), "{lines:?}");
        }
    }
}
