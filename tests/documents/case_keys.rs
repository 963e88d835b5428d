//! `host/CASE.md` lists exactly the keys that the parsers of cases and sidecars accept.

use std::collections::BTreeSet;
use std::path::Path;

use quietcut::case::Case;
use quietcut::recording::Sidecar;
use quietcut::simulate::Effects;
use quietcut::simulate::effect::ALL;
use quietcut::simulate::effect::table::markdown;
use quietcut_tests::command::folder;
use quietcut_tests::documents::{assert_generated, text};

const PAGE: &str = "host/CASE.md";

/// A key that no section of a case accepts.
const STRANGER: &str = "no_such_key";

/// The rows of the table under a heading of the page, as cells, without the two head rows.
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

/// The keys that the page lists for a section, including those of standard deviations.
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

/// The words in grave accents in the message about an unknown key, without the key itself.
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
        (
            "[[structure.at_speed]]",
            format!("{structure}[[structure.at_speed]]\n"),
        ),
        (
            "[[structure.at_speed.mode]]",
            format!("{structure}[[structure.at_speed]]\nrpm = 1.0\n[[structure.at_speed.mode]]\n"),
        ),
        ("[tool]", "[tool]\n".into()),
        ("[material]", "[material]\n".into()),
        ("[cut]", "[cut]\n".into()),
        ("[limits]", "[limits]\n".into()),
        ("[posture]", "[posture]\n".into()),
        ("[uncertainty]", "[uncertainty]\n".into()),
        ("[provenance]", "[provenance]\n".into()),
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
    assert_generated(PAGE, Some("extensions"), &markdown());
    for spec in ALL {
        let case = |more: &str| {
            let text = format!("[extension.{}]\n{}\n{more}\n", spec.name, spec.example);
            Case::parse(Path::new("case.toml"), &text)
        };
        let read = case("").unwrap_or_else(|error| panic!("{}: {error}", spec.name));
        Effects::of_case(&read).unwrap_or_else(|error| panic!("{}: {error}", spec.name));
        // The message about an unknown key lists all keys of the effect.
        let stranger = format!("{STRANGER} = 1");
        let message = case(&stranger).expect_err("an unknown key").to_string();
        for key in spec.keys() {
            assert!(message.contains(key), "{}: {key} is not in {message}", spec.name);
        }
    }
}
