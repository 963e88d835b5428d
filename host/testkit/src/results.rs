//! Results of a test campaign in `tests/results/NAME.json`, from which `host/VALIDATION.md` is assembled.

use std::process::Command;

use serde_json::json;

/// A test campaign and the command that reproduces its figures.
#[derive(Clone, Debug)]
pub struct Campaign<'a> {
    /// Name of the result file of the campaign, without extension.
    pub name: &'a str,
    /// Heading of the campaign on the page.
    pub title: &'a str,
    /// The command that prints the figures.
    pub command: &'a str,
    /// Number and kind of the random seeds.
    pub seeds: &'a str,
}

impl Campaign<'_> {
    /// Writes the campaign, name and value of each figure, commit and compiler version to the result file.
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

/// First line of a program's output; `None` if the program cannot be run, fails, or prints no line or no UTF-8.
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
