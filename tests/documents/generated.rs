//! Parts of pages that are generated from the code and from the results of campaigns.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;

use quietcut_tests::documents::{Block, assert_generated, blocks, files, root, text};
use quietcut_tests::emulator::command_line;
use serde_json::Value;

/// The first sentence at the head of a source file.
fn first_sentence(source: &str) -> String {
    let head: Vec<_> = source
        .lines()
        .map_while(|line| line.strip_prefix("//!"))
        .map(str::trim)
        .take_while(|line| !line.is_empty())
        .collect();
    let head = head.join(" ");
    // A sentence ends before a capital letter, so that "eq. 3.7" does not end one.
    let end = head
        .match_indices(". ")
        .find(|(at, _)| head[at + 2..].starts_with(char::is_uppercase))
        .map_or(head.len(), |(at, _)| at);
    head[..end].trim_end_matches(['.', ':']).to_owned()
}

#[test]
fn the_page_of_tests_lists_every_test() {
    let mut list = String::from("| test | |\n|---|---|\n");
    let manifest = text("tests/Cargo.toml");
    for path in manifest.lines().filter_map(|line| line.strip_prefix("path = \"")) {
        let path = path.trim_end_matches('"');
        if path.starts_with("support") {
            continue;
        }
        let sentence = first_sentence(&text(&format!("tests/{path}")));
        assert!(!sentence.is_empty(), "{path} does not say what it tests");
        writeln!(list, "| `tests/{path}` | {sentence} |").expect("a string grows");
    }
    assert_generated("tests/README.md", Some("tests"), &list);
}

/// The page lists every constant of a file `criteria.rs` whose comment contains the word "unfounded".
#[test]
fn the_page_of_limitations_lists_every_unfounded_number() {
    let mut list = String::new();
    for path in files(&root(), &|path| path.ends_with("criteria.rs")) {
        let source = fs::read_to_string(&path).expect("a source file");
        let file = path
            .strip_prefix(root())
            .expect("below the root")
            .display()
            .to_string();
        let mut comment = String::new();
        for line in source.lines().map(str::trim) {
            if let Some(rest) = line.strip_prefix("///").or_else(|| line.strip_prefix("//")) {
                comment += rest;
                comment.push(' ');
                continue;
            }
            let item = line
                .trim_start_matches("pub")
                .trim_start_matches("(crate)")
                .trim_start_matches("(super)")
                .trim_start();
            let item = item.trim_start_matches("const ");
            if comment.to_lowercase().contains("unfounded") && item.contains([':', '(']) {
                let name = item.split([':', '(']).next().unwrap_or(item);
                let mut comment = comment.split_whitespace().collect::<Vec<_>>().join(" ");
                // A path relative to the file's folder is written relative to the root.
                let spans: Vec<_> = comment.split('`').skip(1).step_by(2).map(str::to_owned).collect();
                let folder = file.trim_end_matches("/criteria.rs");
                for span in spans.iter().filter(|span| span.contains('/')) {
                    let full = format!("{folder}/{span}");
                    if root().join(&full).exists() {
                        comment = comment.replace(&format!("`{span}`"), &format!("`{full}`"));
                    }
                }
                writeln!(list, "- `{name}` in `{file}`: {comment}").expect("a string grows");
            }
            if !line.starts_with("#[") {
                comment.clear();
            }
        }
    }
    if list.is_empty() {
        list = "No number is marked so at present.\n".into();
    }
    assert_generated("host/LIMITATIONS.md", Some("unfounded"), &list);
}

#[test]
fn the_page_of_validation_has_every_result() {
    let mut page = String::new();
    for path in files(&root().join("tests/results"), &|path| {
        path.extension().is_some_and(|ending| ending == "json")
    }) {
        let result: Value = serde_json::from_str(&fs::read_to_string(&path).expect("a result"))
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let Some(figures) = result["figures"].as_array() else {
            continue;
        };
        let of = |key: &str| result[key].as_str().unwrap_or("not recorded").trim().to_owned();
        let (title, command) = (of("title"), of("command"));
        // Campaigns write the compiler. Figures without it are older than the code that writes them.
        let commit = match result["compiler"].as_str() {
            Some(compiler) => format!("Commit {}, compiler {compiler}", of("commit")),
            None => format!(
                "Not run on this tree: as stated in the README of commit {}, compiler not recorded",
                of("commit")
            ),
        };
        write!(
            page,
            "### {title}\n\n```sh campaign\n{command}\n```\n\n{commit}, seeds: {}.\n\n| | |\n|---|---|\n",
            of("seeds")
        )
        .expect("a string grows");
        for figure in figures {
            let word = |key: &str| figure[key].as_str().unwrap_or_default();
            writeln!(page, "| {} | {} |", word("figure"), word("value")).expect("a string grows");
        }
        page.push('\n');
    }
    assert_generated("host/VALIDATION.md", Some("results"), &page);
}

/// The pins in `firmware/README.md` are those at the head of the board's source.
#[test]
fn the_wiring_table_is_that_of_the_board() {
    let rows = |text: &str| -> BTreeSet<(String, String)> {
        text.lines()
            .filter_map(|line| line.trim_start_matches("//!").trim().strip_prefix("| "))
            .filter_map(|row| {
                let mut cells = row.split(" | ");
                Some((cells.next()?.to_owned(), cells.next()?.to_owned()))
            })
            .filter(|(pin, _)| pin.starts_with('P') || *pin == "SWD")
            .collect()
    };
    let board = rows(&text("firmware/src/bin/nucleo_g474re/main.rs"));
    assert!(board.len() >= 8, "{board:?}");
    assert_eq!(rows(&text("firmware/README.md")), board);
}

/// The emulator's command line in `firmware/README.md` is the one with which the tests start it.
#[test]
fn the_command_line_of_the_emulator_is_that_of_the_tests() {
    let commands = blocks("firmware/README.md")
        .into_iter()
        .filter_map(|block| match block {
            Block::Commands { commands, .. } => Some(commands),
            Block::File { .. } => None,
        });
    let (_, command) = commands
        .flatten()
        .find(|(_, command)| command.starts_with("qemu-system-arm"))
        .expect("the command line of the emulator");
    let words: Vec<_> = command.split_whitespace().collect();
    let wanted = command_line("target/thumbv7em-none-eabihf/firmware/qemu_mps2");
    assert_eq!(words, wanted);
}

/// Every setting that a test or script reads stands in `tests/README.md`, and none that nothing reads.
#[test]
fn the_page_of_tests_lists_every_setting() {
    let settings = |text: &str| -> BTreeSet<String> {
        text.match_indices("QUIETCUT_")
            .map(|(at, _)| {
                let is_of_name = |c: char| c.is_ascii_uppercase() || c == '_';
                text[at..].chars().take_while(|c| is_of_name(*c)).collect()
            })
            .collect()
    };
    let folders = ["host", "shared", "firmware", "tests"];
    let read: BTreeSet<String> = folders
        .iter()
        .flat_map(|folder| {
            files(&root().join(folder), &|path| {
                path.extension().is_none_or(|ending| ending == "rs")
            })
        })
        .flat_map(|path| settings(&fs::read_to_string(path).unwrap_or_default()))
        .filter(|name| name != "QUIETCUT_")
        .collect();
    let page = text("tests/README.md");
    let table: String = page
        .lines()
        .filter(|line| line.starts_with("| `QUIETCUT_"))
        .collect();
    assert_eq!(settings(&table), read);
}

/// The members of the workspace with the crates of the project that each uses, in the order of the layers.
#[test]
fn the_page_of_architecture_has_the_crates_as_they_are() {
    let layers = [
        "shared",
        "firmware",
        "host/numerics",
        "host/recording",
        "host/model",
        "host/frf",
        "host/simulate",
        "host/stability",
        "host/identify",
        "host/diagnose",
        "host",
        "host/testkit",
        "tests",
    ];
    let workspace = text("Cargo.toml");
    let members = workspace
        .lines()
        .find(|line| line.starts_with("members"))
        .expect("members");
    let members: BTreeSet<_> = members.split('"').skip(1).step_by(2).collect();
    assert_eq!(
        members,
        layers.into_iter().collect(),
        "a crate is missing in the list of layers"
    );

    let mut list = String::from("| folder | crate | uses |\n|---|---|---|\n");
    let mut above = BTreeSet::new();
    for folder in layers {
        let manifest = text(&format!("{folder}/Cargo.toml"));
        let name = manifest
            .lines()
            .find_map(|line| line.strip_prefix("name = \""))
            .expect("a crate has a name")
            .trim_end_matches('"');
        let used: Vec<_> = manifest
            .lines()
            .skip_while(|line| *line != "[dependencies]")
            .skip(1)
            .take_while(|line| !line.starts_with('['))
            .filter(|line| line.starts_with("quietcut"))
            .filter_map(|line| line.split(['.', ' ', '=']).next())
            .collect();
        for crate_used in &used {
            assert!(
                above.contains(*crate_used),
                "{name} uses {crate_used}, which does not stand above it"
            );
        }
        let short: Vec<_> = used
            .iter()
            .map(|name| name.trim_start_matches("quietcut-"))
            .collect();
        writeln!(list, "| `{folder}` | `{name}` | {} |", short.join(", ")).expect("a string grows");
        above.insert(name.to_owned());
    }
    assert_generated("host/ARCHITECTURE.md", Some("crates"), &list);
}

/// Every room of the crates that have rooms stands on the page.
#[test]
fn the_page_of_architecture_has_every_room() {
    let page = text("host/ARCHITECTURE.md");
    let mut missing = Vec::new();
    for folder in ["host/stability/src", "host/identify/src", "host/diagnose/src"] {
        for entry in fs::read_dir(root().join(folder)).expect("a folder").flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.path().is_dir() && name != "tests" && !page.contains(&format!("\n| `{name}` |")) {
                missing.push(format!("{folder}/{name}"));
            }
        }
    }
    assert!(
        missing.is_empty(),
        "host/ARCHITECTURE.md has no row for {missing:?}"
    );
}

/// The version to cite is that of the crates.
#[test]
fn the_version_to_cite_is_that_of_the_crates() {
    let version = format!("version: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(
        text("CITATION.cff").contains(&version),
        "CITATION.cff has another version"
    );
}
