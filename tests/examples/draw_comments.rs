//! Draws comments of the code at random. A reader who has not seen the code then says what each comment means.
//!
//! ```text
//! cargo run --release -p quietcut-tests --example draw_comments -- SEED [COUNT]
//! ```
//!
//! Prints one JSON object per line: the file, the line, the comment, and the line of code that follows it. Comments of fewer
//! than six words, tests, and files that are going to be replaced are excluded.

use std::error::Error;
use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Smallest number of words of a comment that can be drawn.
const FEWEST_WORDS: usize = 6;

/// Number of comments that are drawn if no number is given.
const COUNT: usize = 60;

/// Files and folders that are going to be replaced: the fits of cuts, and the device's estimators.
const TO_BE_REPLACED: [&str; 12] = [
    "closed_fit",
    "closed_loop",
    "closed_selection",
    "relinearization",
    "own_slopes",
    "motion_estimate",
    "chips",
    "amplification",
    "mean_slopes",
    "stroboscope",
    "detector",
    "tachometer",
];

/// A comment with its file and line, and the code that follows it.
#[derive(Serialize)]
struct Comment {
    file: PathBuf,
    line: usize,
    text: String,
    code: String,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let seed: u64 = arguments
        .next()
        .ok_or("usage: draw_comments SEED [COUNT]")?
        .parse()?;
    let count = arguments.next().map_or(Ok(COUNT), |text| text.parse())?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize()?;
    let mut files = Vec::new();
    for part in ["shared/src", "firmware/src", "host"] {
        collect(&root.join(part), &mut files)?;
    }
    files.sort();
    let mut comments = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file)?;
        comments.extend(comments_of(file.strip_prefix(&root)?, &text));
    }
    eprintln!("seed {seed}: {count} of {} comments", comments.len());
    comments.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    for comment in comments.iter().take(count) {
        println!("{}", serde_json::to_string(comment)?);
    }
    Ok(())
}

/// Collects all source files below a folder, except tests and files that are going to be replaced.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let stem = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or_default();
        let is_test = stem == "target" || stem == "tests" || stem.ends_with("_tests") || stem == "testkit";
        if is_test || TO_BE_REPLACED.contains(&stem) {
            continue;
        }
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// The text of a line that is a comment; `None` for other lines.
fn commented(line: &str) -> Option<&str> {
    let line = line.trim_start();
    ["///", "//!", "//"]
        .iter()
        .find_map(|mark| line.strip_prefix(mark))
}

fn comments_of(file: &Path, text: &str) -> Vec<Comment> {
    let all: Vec<&str> = text.lines().collect();
    let is_test_module = |pair: &[&str]| pair[0] == "#[cfg(test)]" && pair[1].ends_with('{');
    let end = all.windows(2).position(is_test_module).unwrap_or(all.len());
    let lines = &all[..end];
    let mut found = Vec::new();
    let mut first = 0;
    while first < lines.len() {
        let length = lines[first..]
            .iter()
            .take_while(|line| commented(line).is_some())
            .count();
        if length == 0 {
            first += 1;
            continue;
        }
        let text: Vec<&str> = lines[first..first + length]
            .iter()
            .filter_map(|line| commented(line))
            .map(str::trim)
            .collect();
        let text = text.join("\n");
        if text.split_whitespace().count() >= FEWEST_WORDS {
            found.push(Comment {
                file: file.to_owned(),
                line: first + 1,
                text,
                code: lines[first + length..]
                    .iter()
                    .map(|line| line.trim())
                    .find(|line| !line.is_empty() && !line.starts_with("#["))
                    .unwrap_or_default()
                    .to_owned(),
            });
        }
        first += length;
    }
    found
}
