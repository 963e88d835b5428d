//! The list of all effects as the table of the documentation and as the text of the help.

use super::{ALL, Parameter};

fn key_in_words(parameter: &Parameter) -> String {
    let Parameter {
        key, unit, meaning, ..
    } = parameter;
    match *unit {
        "" => format!("`{key}` ({meaning})"),
        unit => format!("`{key}` ({unit}: {meaning})"),
    }
}

/// The table of all effects in Markdown: name, equation, keys with units and meanings, example.
pub fn markdown() -> String {
    let mut table = String::from("| name | equation | keys | example |\n|---|---|---|---|\n");
    for spec in ALL {
        let own = spec
            .parameters
            .iter()
            .filter(|parameter| !parameter.key.is_empty())
            .map(key_in_words);
        let locations = spec.locations.keys().iter().map(|key| format!("`{key}`"));
        let keys: Vec<String> = own.chain(locations).collect();
        let row = format!(
            "| `{}` | {} | {} | `{}` |\n",
            spec.name,
            spec.equation.replace('|', "\\|"),
            keys.join(", "),
            spec.example.replace('\n', ", ")
        );
        table.push_str(&row);
    }
    table
}

/// The list of all effects for the help: name, equation, keys.
pub fn help() -> String {
    let mut text = String::from("Effects (NAME=VALUE sets the first quantity, NAME.KEY=VALUE any other):\n");
    for spec in ALL {
        let row = format!(
            "  {:<28} {}\n{:31}{}\n",
            spec.name,
            spec.equation,
            "",
            spec.keys_in_words()
        );
        text.push_str(&row);
    }
    text
}
