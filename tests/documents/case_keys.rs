//! `host/CASE.md` lists every key that the parsers of cases and sidecars know, and no other.

use std::collections::BTreeSet;
use std::path::Path;

use quietcut::case::{Case, EXTENSION_NAMES};
use quietcut::recording::Sidecar;
use quietcut::simulate::Effects;
use quietcut_tests::command::folder;
use quietcut_tests::documents::text;

const PAGE: &str = "host/CASE.md";

/// A key that no section has.
const STRANGER: &str = "no_such_key";

/// The rows of the table under a heading, by columns, without its two head rows.
fn rows(heading: &str) -> Vec<Vec<String>> {
    let page = text(PAGE);
    let rows: Vec<_> = page
        .lines()
        .skip_while(|line| line.strip_prefix("## ") != Some(heading))
        .skip(1)
        .take_while(|line| !line.starts_with("## "))
        .filter(|line| line.starts_with("| `"))
        .map(|line| {
            let cells = line.trim_matches('|').split(" | ");
            cells.map(|cell| cell.trim().to_owned()).collect::<Vec<_>>()
        })
        .collect();
    assert!(!rows.is_empty(), "{PAGE} has no table under {heading}");
    rows
}

/// The keys of a section as the page has them, those of standard deviations among them.
fn keys_on_page(heading: &str) -> BTreeSet<String> {
    rows(heading)
        .iter()
        .flat_map(|row| {
            let key = row[0].trim_matches('`').to_owned();
            let std = (row.last().is_some_and(|last| last.starts_with("std"))).then(|| format!("{key}_std"));
            [Some(key), std]
        })
        .flatten()
        .collect()
}

/// The words in grave accents that a message says instead of the stranger.
fn expected(message: &str) -> BTreeSet<String> {
    let (_, expected) = message
        .rsplit_once("expected ")
        .unwrap_or_else(|| panic!("no list of keys in: {message}"));
    expected
        .split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_page_has_every_key_of_a_case() {
    let structure = "[structure]\nkind = \"modes\"\ndirections = [\"x\"]\n";
    for (heading, head) in [
        ("Case", String::new()),
        ("[structure]", "[structure]\n".into()),
        ("[[structure.mode]]", format!("{structure}[[structure.mode]]\n")),
        ("[[structure.joint]]", format!("{structure}[[structure.joint]]\n")),
        ("[tool]", "[tool]\n".into()),
        ("[material]", "[material]\n".into()),
        ("[cut]", "[cut]\n".into()),
        ("[limits]", "[limits]\n".into()),
        ("[posture]", "[posture]\n".into()),
    ] {
        let case = format!("{head}{STRANGER} = 1\n");
        let error = Case::parse(Path::new("case.toml"), &case).expect_err("an unknown key");
        assert_eq!(keys_on_page(heading), expected(&error.to_string()), "{heading}");
    }
}

#[test]
fn the_page_has_every_key_of_a_sidecar() {
    let folder = folder();
    let recording = folder.path().join("record.csv");
    for (heading, head) in [
        ("Sidecar", ""),
        ("Sidecar [cut]", "[cut]\n"),
        ("Sidecar [posture]", "[posture]\n"),
        ("Sidecar [channels.NAME]", "[channels.ax]\n"),
    ] {
        std::fs::write(Sidecar::path_of(&recording), format!("{head}{STRANGER} = 1\n")).expect("a sidecar");
        let error = Sidecar::beside(&recording).expect_err("an unknown key");
        assert_eq!(keys_on_page(heading), expected(&error.to_string()), "{heading}");
    }
}

#[test]
fn the_page_has_every_extension_with_an_example_that_reads() {
    let rows = rows("[extension.NAME]");
    let names: BTreeSet<_> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    assert_eq!(names, EXTENSION_NAMES.into_iter().collect());
    for row in &rows {
        let name = row[0].trim_matches('`');
        let example = row.last().expect("a row").trim_matches('`');
        let case = |more: &str| {
            let body = example
                .replace(", direction", "\ndirection")
                .replace(", channel", "\nchannel");
            let lines: Vec<_> = split_outside_lists(&body);
            let text = format!("[extension.{name}]\n{}\n{more}\n", lines.join("\n"));
            Case::parse(Path::new("case.toml"), &text)
        };
        let read = case("").unwrap_or_else(|error| panic!("{name}: {error}"));
        Effects::of_case(&read).unwrap_or_else(|error| panic!("{name}: {error}"));
        if name == "axial-depth-modulation" {
            continue;
        }
        // An unknown key is answered with all that the effect has.
        let stranger = format!("{STRANGER} = 1");
        let message = match case(&stranger) {
            Err(error) => error.to_string(),
            Ok(case) => Effects::of_case(&case).expect_err("an unknown key").to_string(),
        };
        let (_, known) = message
            .split_once("it has ")
            .unwrap_or_else(|| panic!("{name}: no list of keys in: {message}"));
        let on_page: BTreeSet<_> = row[2].split('`').skip(1).step_by(2).collect();
        let missing: Vec<_> = known
            .split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
            .filter(|word| word.contains('_') && !on_page.contains(word))
            .collect();
        assert!(
            missing.is_empty(),
            "{name}: {missing:?} of `{known}` are not on the page"
        );
        for key in on_page.iter().filter(|key| key.contains('_')) {
            assert!(known.contains(*key), "{name}: the effect has no {key}: {known}");
        }
    }
}

/// `a = 1, b = ["x", "y"]` as lines of TOML.
fn split_outside_lists(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut depth = 0;
    for character in text.chars() {
        match character {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ => {}
        }
        match (character, depth) {
            (',', 0) => lines.push(String::new()),
            (_, _) => lines.last_mut().expect("a line").push(character),
        }
    }
    lines
}
