//! The project's pages: their code blocks, links and paths.
//!
//! In the info string of a fence, the first word is the language. The second word says what a test does with the block:
//!
//! | fence | meaning |
//! |---|---|
//! | `sh` | runs in a test, line by line, in a temporary folder that holds `tests/cases` and `host/pictures/cuts.csv` |
//! | `sh build` | compiles or runs the whole project: its packages, targets and scripts must exist |
//! | `sh campaign` | takes minutes to hours: its packages and targets must exist, and its filters must select tests of its target |
//! | `sh hardware` | requires a device: its verbs and options must exist |
//! | `csv NAME`, `toml NAME` | is the file NAME for the commands that follow |
//! | any other language | is output or a sketch, and is not checked |

use std::fs;
use std::path::{Path, PathBuf};

use crate::command;

/// The pages that the tests check, relative to the root of the repository.
pub const PAGES: [&str; 11] = [
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "README.md",
    "firmware/README.md",
    "host/ARCHITECTURE.md",
    "host/CASE.md",
    "host/GUIDE.md",
    "host/LIMITATIONS.md",
    "host/VALIDATION.md",
    "shared/README.md",
    "tests/README.md",
];

/// The word after `sh`, which says what a test requires of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handling {
    /// The command runs to its end with exit status 0.
    Run,
    /// Packages, targets and scripts exist.
    Build,
    /// Packages and targets exist, and the filters select tests of the target.
    Campaign,
    /// Verbs and options exist.
    Hardware,
}

/// A fenced block of a page.
#[derive(Clone, Debug)]
pub enum Block {
    /// Commands, one a line, with continued lines joined and comments removed.
    Commands {
        /// The check that a test does.
        handling: Handling,
        /// The commands with their line numbers.
        commands: Vec<(usize, String)>,
    },
    /// A file for the commands that follow.
    File {
        /// Its name.
        name: String,
        /// Its content.
        content: String,
    },
}

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests lie in the repository")
        .to_path_buf()
}

/// The text of a page.
pub fn text(page: &str) -> String {
    fs::read_to_string(root().join(page)).unwrap_or_else(|error| panic!("{page}: {error}"))
}

/// The fenced blocks of a page, in order.
///
/// # Panics
/// A block of commands has an unknown word behind `sh`.
pub fn blocks(page: &str) -> Vec<Block> {
    let text = text(page);
    let mut lines = text.lines().enumerate();
    let mut blocks = Vec::new();
    while let Some((number, line)) = lines.next() {
        let Some(fence) = line.strip_prefix("```") else {
            continue;
        };
        let body: Vec<_> = lines
            .by_ref()
            .map(|(number, line)| (number + 1, line))
            .take_while(|(_, line)| *line != "```")
            .collect();
        match fence.split_whitespace().collect::<Vec<_>>()[..] {
            ["sh", ref words @ ..] => {
                let handling = match words {
                    [] => Handling::Run,
                    ["build"] => Handling::Build,
                    ["campaign"] => Handling::Campaign,
                    ["hardware"] => Handling::Hardware,
                    _ => panic!("{page}:{}: unknown kind of block: {fence}", number + 1),
                };
                let commands = commands(&body);
                blocks.push(Block::Commands { handling, commands });
            }
            ["csv" | "toml", name] => {
                let content = body.iter().map(|(_, line)| format!("{line}\n")).collect();
                let name = name.into();
                blocks.push(Block::File { name, content });
            }
            _ => {}
        }
    }
    blocks
}

fn commands(body: &[(usize, &str)]) -> Vec<(usize, String)> {
    let mut commands: Vec<(usize, String)> = Vec::new();
    let mut is_continued = false;
    for &(number, line) in body {
        let line = line.split(" #").next().unwrap_or("").trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let part = line.trim_end_matches('\\').trim_end();
        match commands.last_mut() {
            Some((_, command)) if is_continued => *command = format!("{command} {part}"),
            _ => commands.push((number, part.into())),
        }
        is_continued = line.ends_with('\\');
    }
    commands
}

/// Runs the commands of a page in order in one temporary folder. Returns the folder and each command with its output.
///
/// # Panics
/// A command ends with an exit status other than 0, or no test can run it.
pub fn run(page: &str) -> (tempfile::TempDir, Vec<(String, String)>) {
    let folder = command::folder();
    let cases = folder.path().join("tests/cases");
    fs::create_dir_all(&cases).expect("a folder can be made");
    for case in fs::read_dir(command::cases()).expect("the cases are there") {
        let case = case.expect("a case can be listed").path();
        let name = case.file_name().expect("a case has a name");
        fs::copy(&case, cases.join(name)).expect("the case can be copied");
    }
    let pictures = folder.path().join("host/pictures");
    fs::create_dir_all(&pictures).expect("a folder can be made");
    fs::copy(root().join("host/pictures/cuts.csv"), pictures.join("cuts.csv")).expect("a table of cuts");

    let mut printed = Vec::new();
    for block in blocks(page) {
        match block {
            Block::File { name, content } => {
                fs::write(folder.path().join(name), content).expect("a file can be written");
            }
            Block::Commands {
                handling: Handling::Run,
                commands,
            } => {
                for (line, command) in commands {
                    let words: Vec<_> = command.split_whitespace().collect();
                    let arguments = match words[..] {
                        ["quietcut", ref rest @ ..] | ["cargo", "run", "--release", "--", ref rest @ ..] => {
                            rest
                        }
                        _ => panic!("{page}:{line}: no command that a test can run: {command}"),
                    };
                    let outcome = command::quietcut(folder.path(), arguments);
                    assert_eq!(outcome.status, Some(0), "{page}:{line}: {command}\n{outcome:?}");
                    printed.push((command, outcome.stdout));
                }
            }
            Block::Commands { .. } => {}
        }
    }
    (folder, printed)
}

/// Checks a command that no test runs. Returns its packages, targets, tests and options that do not exist.
pub fn missing(handling: Handling, command: &str) -> Vec<String> {
    // Assignments of environment variables precede the command.
    let words: Vec<_> = command
        .split_whitespace()
        .skip_while(|word| word.contains('=') && !word.starts_with('-'))
        .collect();
    match words[..] {
        ["quietcut", verb, ref rest @ ..] => missing_of_verb(verb, rest),
        ["cargo", "run", "--release", "--", verb, ref rest @ ..] => missing_of_verb(verb, rest),
        ["cargo", ref rest @ ..] => missing_of_cargo(handling, rest),
        [script, ..] if script.contains('/') && root().join(script).is_file() => Vec::new(),
        // Programs outside of the repository: a debugger, an emulator, a terminal.
        [program, ..] if handling == Handling::Hardware && !program.contains('/') => Vec::new(),
        _ => vec![command.into()],
    }
}

fn missing_of_verb(verb: &str, rest: &[&str]) -> Vec<String> {
    let help = command::quietcut(&root(), &["help", verb]);
    if help.status != Some(0) {
        return vec![format!("the verb {verb}")];
    }
    rest.iter()
        .filter(|word| word.starts_with("--") && !help.stdout.contains(*word))
        .map(|word| format!("{word} of {verb}"))
        .collect()
}

fn missing_of_cargo(handling: Handling, words: &[&str]) -> Vec<String> {
    let mut missing = Vec::new();
    let (own, of_tests) = match words.iter().position(|word| *word == "--") {
        Some(at) => (&words[..at], &words[at + 1..]),
        None => (words, &[][..]),
    };
    let manifests = sources("Cargo.toml");
    let has = |text: &str| manifests.iter().any(|(_, manifest)| manifest.contains(text));
    let is_file = |name: &str| !files(&root(), &|path| path.ends_with(name)).is_empty();
    for pair in own.windows(2) {
        let exists = match pair[0] {
            "-p" | "--package" | "--test" | "--bench" => has(&format!("name = \"{}\"", pair[1])),
            "--example" => is_file(&format!("examples/{}.rs", pair[1])),
            "--bin" => has(&format!("name = \"{}\"", pair[1])) || is_file(&format!("bin/{}.rs", pair[1])),
            _ => true,
        };
        if !exists {
            missing.push(format!("{} {}", pair[0], pair[1]));
        }
    }
    if handling == Handling::Campaign && own.first() == Some(&"test") {
        let is_ignored = of_tests.contains(&"--ignored");
        let tests = tests_of(own, is_ignored);
        let has_values = ["-p", "--package", "--test", "--test-threads", "--skip"];
        let own_filters = own.iter().skip(1).zip(own);
        let filters = own_filters.chain(of_tests.iter().zip([&"--"].into_iter().chain(of_tests)));
        for (word, before) in filters {
            if word.starts_with('-') || has_values.contains(before) {
                continue;
            }
            if !tests.iter().any(|test| test.contains(*word)) {
                missing.push(format!("a test {word} of {}", own.join(" ")));
            }
        }
        if tests.is_empty() {
            missing.push(format!("a test of {}", own.join(" ")));
        }
    }
    missing
}

/// The tests of the package and target that the `words` of a command select, ignored or not, as the test harness names them: modules
/// and function, joined by `::`.
fn tests_of(words: &[&str], is_ignored: bool) -> Vec<String> {
    let value_of = |option: &str| {
        let at = words.iter().position(|word| *word == option)?;
        words.get(at + 1).copied()
    };
    let name_line = format!("name = \"{}\"", value_of("-p").unwrap_or_default());
    let manifests = sources("Cargo.toml");
    let Some((path, manifest)) = manifests
        .iter()
        .find(|(_, text)| text.lines().any(|line| line == name_line))
    else {
        return Vec::new();
    };
    let package = path.parent().expect("a manifest lies in a folder");
    let folder = match value_of("--test") {
        None => package.join("src"),
        Some(target) => {
            // The manifest names the file of a test in the line below its name.
            let name_line = format!("name = \"{target}\"");
            let mut lines = manifest.lines().skip_while(|line| *line != name_line);
            let path = lines
                .nth(1)
                .and_then(|line| line.split('"').nth(1))
                .unwrap_or_default();
            let file = package.join(path);
            if !file.ends_with("main.rs") {
                return tests_in(&file, "", is_ignored);
            }
            file.parent().expect("a file lies in a folder").to_path_buf()
        }
    };
    let code = files(&folder, &|path| {
        path.extension().is_some_and(|ending| ending == "rs")
    });
    code.iter()
        .flat_map(|file| {
            let below = file.strip_prefix(&folder).unwrap_or(file).with_extension("");
            let modules: Vec<_> = below
                .iter()
                .filter_map(|part| part.to_str())
                .filter(|part| !["lib", "main", "mod"].contains(part))
                .collect();
            tests_in(file, &(modules.join("::") + "::"), is_ignored)
        })
        .collect()
}

/// The tests of a file, ignored or not, each behind `prefix`.
fn tests_in(file: &Path, prefix: &str, is_ignored: bool) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap_or_default();
    let (mut test, mut ignored) = (false, false);
    let mut found = Vec::new();
    for line in text.lines().map(str::trim_start) {
        if line == "#[test]" {
            (test, ignored) = (true, false);
        } else if line.starts_with("#[ignore") {
            ignored = true;
        } else if let Some(name) = line.strip_prefix("fn ") {
            if test && ignored == is_ignored {
                found.push(format!("{prefix}{}", name.split('(').next().unwrap_or(name)));
            }
            test = false;
        }
    }
    found
}

/// The files of the repository that satisfy a condition, without built files.
pub fn files(folder: &Path, wanted: &dyn Fn(&Path) -> bool) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = entry.file_name();
        if path.is_dir() {
            if name != "target" && name != ".git" {
                found.extend(files(&path, wanted));
            }
        } else if wanted(&path) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn sources(ending: &str) -> Vec<(PathBuf, String)> {
    files(&root(), &|path| path.to_string_lossy().ends_with(ending))
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).unwrap_or_default();
            (path, text)
        })
        .collect()
}

/// The relative links of a page without a target, and the paths in its code spans that do not exist.
pub fn dead_ends(page: &str) -> Vec<String> {
    let text = text(page);
    let folder = root().join(page);
    let folder = folder.parent().expect("a page lies in a folder");
    let mut dead = Vec::new();
    let mut is_block = false;
    for (number, line) in text.lines().enumerate() {
        is_block ^= line.starts_with("```");
        if is_block {
            continue;
        }
        let place = format!("{page}:{}", number + 1);
        for target in line.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.starts_with("http") {
                continue;
            }
            let (path, heading) = target.split_once('#').unwrap_or((target, ""));
            let file = if path.is_empty() {
                root().join(page)
            } else {
                folder.join(path)
            };
            if !file.exists() {
                dead.push(format!("{place}: link to {target}"));
            } else if !heading.is_empty() && !anchors(&file).contains(&heading.to_owned()) {
                dead.push(format!("{place}: no heading for {target}"));
            }
        }
        for span in line.split('`').skip(1).step_by(2) {
            let first = span.split('/').next().unwrap_or("");
            let is_path = span.contains('/')
                && ["shared", "firmware", "host", "tests", ".ci"].contains(&first)
                && !span.contains(['*', '<', ' ', '{', '…']);
            if is_path && !root().join(span).exists() {
                dead.push(format!("{place}: path {span}"));
            }
        }
    }
    dead
}

/// The anchors that a Markdown renderer generates from the headings of a file.
fn anchors(file: &Path) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap_or_default();
    text.lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| {
            line.trim_start_matches('#')
                .trim()
                .to_lowercase()
                .chars()
                .filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c))
                .map(|c| if c == ' ' { '-' } else { c })
                .collect()
        })
        .collect()
}

/// Compares a file, or the part of a page between `<!-- generated: NAME -->` and `<!-- end -->`, with its expected text.
///
/// If `QUIETCUT_WRITE` is set, it writes the expected text instead.
///
/// # Panics
/// The texts differ, or the page has no such part.
pub fn assert_generated(page: &str, part: Option<&str>, wanted: &str) {
    let path = root().join(page);
    let old = fs::read_to_string(&path).unwrap_or_default();
    let new = match part {
        None => wanted.to_owned(),
        Some(name) => {
            let opening = format!("<!-- generated: {name} -->\n");
            let (head, rest) = old
                .split_once(&opening)
                .unwrap_or_else(|| panic!("{page} has no part {name}"));
            let (_, tail) = rest
                .split_once("<!-- end -->")
                .unwrap_or_else(|| panic!("{page}: the part {name} does not end"));
            format!("{head}{opening}{wanted}<!-- end -->{tail}")
        }
    };
    if std::env::var_os("QUIETCUT_WRITE").is_some() {
        if old != new {
            fs::write(&path, &new).unwrap_or_else(|error| panic!("{page}: {error}"));
        }
        return;
    }
    let differs = old.lines().zip(new.lines()).find(|(old, new)| old != new);
    assert!(
        old == new,
        "{page} is not what the code says, first in {differs:?}; after a look: \
         QUIETCUT_WRITE=yes cargo test --release -p quietcut-tests --test documents"
    );
}
