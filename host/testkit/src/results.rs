//! Figures of a campaign in `tests/results/NAME.json`, from which `host/VALIDATION.md` is assembled.

use std::process::Command;

use serde_json::json;

/// A campaign: how its figures come about.
#[derive(Clone, Debug)]
pub struct Campaign<'a> {
    /// Name of its file, without ending.
    pub name: &'a str,
    /// Heading on the page.
    pub title: &'a str,
    /// The command that prints the figures.
    pub command: &'a str,
    /// How many seeds, and of what.
    pub seeds: &'a str,
}

impl Campaign<'_> {
    /// Writes the figures, each with its name, beside commit and compiler.
    ///
    /// # Panics
    /// The file cannot be written.
    pub fn record(&self, figures: &[(String, String)]) {
        let figures: Vec<_> = figures
            .iter()
            .map(|(figure, value)| json!({ "figure": figure, "value": value }))
            .collect();
        let result = json!({
            "title": self.title,
            "command": self.command,
            "commit": first_line_of("git", &["describe", "--always", "--dirty", "--exclude=*"]),
            "compiler": first_line_of("rustc", &["--version"]),
            "seeds": self.seeds,
            "figures": figures,
        });
        let folder = crate::tests_folder().join("results");
        let path = folder.join(format!("{}.json", self.name));
        let text = serde_json::to_string_pretty(&result).expect("a campaign can be written as JSON");
        std::fs::create_dir_all(folder).expect("the folder of results can be made");
        std::fs::write(path, text + "\n").expect("the results can be written");
    }
}

/// `None` where the program is missing or fails.
fn first_line_of(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(crate::tests_folder())
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let line = text.lines().next()?.to_owned();
    output.status.success().then_some(line)
}
