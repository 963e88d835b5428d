//! The answer to a question: exit codes, JSON, and the files that were written.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::hash::{DefaultHasher, Hasher};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::json::Json;
use crate::question::Question;

/// Number of evenly spaced rows that the reference holds of a table.
const SAMPLED_ROWS: usize = 8;

/// Runs the commands of `question` in a new folder, from which the name `tests` leads to the folder of the tests.
pub(crate) fn answer(command: &Path, tests: &Path, question: &Question) -> Result<Json, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    std::os::unix::fs::symlink(tests, folder.path().join("tests")).map_err(|error| error.to_string())?;
    let mut steps = Vec::new();
    let mut seen = BTreeSet::new();
    for line in &question.commands {
        let output = Command::new(command)
            .args(line.split_whitespace())
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .output()
            .map_err(|error| format!("{}: {error}", command.display()))?;
        let mut step = vec![
            ("command".to_owned(), Json::Text(line.clone())),
            ("exit".to_owned(), count(output.status.code().unwrap_or(-1))),
        ];
        let text = String::from_utf8_lossy(&output.stdout);
        if output.status.success() && line.split_whitespace().any(|word| word == "--json") {
            let lines: Vec<&str> = text.lines().filter(|l| !l.is_empty()).collect();
            let values: Result<Vec<_>, _> = lines.iter().map(|l| Json::read(l)).collect();
            match values.or_else(|_| Json::read(&text).map(|v| vec![v])) {
                Ok(values) => step.push(("json".to_owned(), Json::List(values))),
                Err(error) => return Err(format!("quietcut {line}: {error}")),
            }
        }
        let written = written(folder.path(), &mut seen)?;
        if !written.is_empty() {
            step.push(("files".to_owned(), Json::Map(written.into_iter().collect())));
        }
        steps.push(Json::Map(step));
    }
    Ok(Json::List(steps))
}

fn count(value: impl ToString) -> Json {
    Json::Number(value.to_string())
}

/// The files in `folder` that are not in `seen`, as values that can be compared.
fn written(folder: &Path, seen: &mut BTreeSet<String>) -> Result<BTreeMap<String, Json>, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        for entry in fs::read_dir(&current).map_err(|error| error.to_string())? {
            let entry = entry.map_err(|error| error.to_string())?;
            let path = entry.path();
            let kind = entry.file_type().map_err(|error| error.to_string())?;
            if kind.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
            if kind.is_symlink() || !seen.insert(name.clone()) {
                continue;
            }
            let bytes = fs::read(&path).map_err(|error| error.to_string())?;
            let text = String::from_utf8_lossy(&bytes);
            let value = match path.extension().and_then(|e| e.to_str()) {
                Some("csv") => table(&text),
                Some("toml") => settings(&text),
                Some("json") => Json::read(&text)?,
                Some("qct") => Json::Map(vec![
                    ("length".to_owned(), count(bytes.len())),
                    ("bytes_hash".to_owned(), hash(&bytes)),
                ]),
                // Pictures and reports repeat numbers of the JSON answer. The memory of a device contains times.
                _ => continue,
            };
            found.insert(name, value);
        }
    }
    Ok(found)
}

/// SipHash with fixed keys, which gives the same value for the same bytes on every machine.
fn hash(bytes: &[u8]) -> Json {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    Json::Text(format!("{:016x}", hasher.finish()))
}

fn cell(text: &str) -> Json {
    let text = text.trim().trim_matches('"');
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Json::Number(text.to_owned()),
        _ => Json::Text(text.to_owned()),
    }
}

/// A CSV table: its head, the number of its rows, and for each column some rows and the sum of the magnitudes.
fn table(text: &str) -> Json {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let head = lines.next().unwrap_or_default();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let column = |i: usize| {
        let cells: Vec<Json> = rows
            .iter()
            .filter_map(|row| row.get(i))
            .map(|text| cell(text))
            .collect();
        let sum: f64 = cells.iter().filter_map(Json::number).map(f64::abs).sum();
        let step = cells.len().div_ceil(SAMPLED_ROWS).max(1);
        let mut sampled: Vec<Json> = cells.iter().skip(step / 2).step_by(step).cloned().collect();
        // The sum is in the same list as the cells, so that it sets the scale of their tolerance: noise about zero needs an
        // absolute one.
        let largest = cells.iter().map(Json::largest).fold(0.0, f64::max);
        sampled.push(Json::Number(format!("{largest:?}")));
        Json::Map(vec![
            ("sum_of_magnitudes".to_owned(), Json::Number(format!("{sum:?}"))),
            ("rows_and_largest".to_owned(), Json::List(sampled)),
        ])
    };
    Json::Map(vec![
        ("head".to_owned(), Json::Text(head.to_owned())),
        ("rows".to_owned(), count(rows.len())),
        (
            "columns".to_owned(),
            Json::List((0..head.split(',').count()).map(column).collect()),
        ),
        ("text_hash".to_owned(), hash(text.as_bytes())),
    ])
}

/// A TOML file as a map: for each key, with the header of its section, the words and numbers of its value.
fn settings(text: &str) -> Json {
    let mut entries: Vec<(String, Json)> = Vec::new();
    let mut section = String::new();
    let mut headers: BTreeMap<String, usize> = BTreeMap::new();
    for line in text.lines().map(str::trim) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if line.starts_with('[') && line.ends_with(']') && !line.contains(',') {
            let nth = headers.entry(line.to_owned()).or_default();
            section = format!("{line}#{nth}");
            *nth += 1;
            continue;
        }
        let (key, value) = line.split_once(" = ").unwrap_or(("", line));
        let cells = value
            .split(|c: char| ",[]{}= ".contains(c))
            .filter(|word| !word.is_empty())
            .map(cell);
        match entries.last_mut() {
            // A line without a key continues the value of the preceding line.
            Some((_, Json::List(list))) if key.is_empty() => list.extend(cells),
            _ => entries.push((format!("{section} {key}"), Json::List(cells.collect()))),
        }
    }
    Json::Map(entries)
}
