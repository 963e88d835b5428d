//! Files as laboratories have them, made by the programs that write them in life: read at once, or with the option that the message names.
//!
//! `tests/tools/make_lab_files.py` makes the files and their truth.

#![allow(clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use quietcut::frf::FrfTable;
use quietcut::recording::{ColumnMap, Import, Recording};
use quietcut_tests::command::{folder, quietcut};
use serde::Deserialize;

/// Truth of one file.
#[derive(Deserialize)]
struct Truth {
    /// `recording`, `frf` or `refused`.
    kind: String,
    /// Options that state what the file does not.
    options: Vec<String>,
    /// Words of the message without the options; empty if the file needs none.
    asks: Vec<String>,
    relative_tolerance: f64,
    #[serde(default)]
    rate_hz: f64,
    #[serde(default)]
    samples: usize,
    #[serde(default)]
    records: usize,
    #[serde(default)]
    warns: Vec<String>,
    #[serde(default)]
    constant: Vec<String>,
    #[serde(default)]
    channels: BTreeMap<String, TrueChannel>,
    #[serde(default)]
    receptances: BTreeMap<String, TrueReceptance>,
}

/// True samples of a channel, SI.
#[derive(Deserialize)]
struct TrueChannel {
    first: f64,
    peak: f64,
    samples_10_to_20: Vec<f64>,
}

/// True peak of a receptance.
#[derive(Deserialize)]
struct TrueReceptance {
    peak_hz: f64,
    peak_m_per_n: f64,
}

fn lab_files() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/lab_files")
}

fn truths() -> BTreeMap<String, Truth> {
    let text = std::fs::read_to_string(lab_files().join("truth.json")).expect("the truth");
    serde_json::from_str(&text).expect("the truth in its form")
}

/// The option values behind `flag`, as the command line splits them.
fn import(options: &[String]) -> Import {
    let value = |flag: &str| {
        let at = options.iter().position(|option| option == flag)?;
        options.get(at + 1)
    };
    Import {
        map: value("--map")
            .iter()
            .flat_map(|map| ColumnMap::parse_list(map).expect("a map").0)
            .collect(),
        rate_hz: value("--rate").map(|rate| rate.parse().expect("a rate")),
        ..Import::default()
    }
}

/// The options that a message proposes: `--map` with its value, in quotes or up to a blank, and `--rate`.
fn proposed(message: &str) -> Vec<String> {
    let mut options = Vec::new();
    for flag in ["--map ", "--rate "] {
        let Some((_, rest)) = message.split_once(flag) else {
            continue;
        };
        let value = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split('"').next().unwrap_or_default(),
            None => rest.split(' ').next().unwrap_or_default(),
        };
        options.extend([flag.trim().to_owned(), value.to_owned()]);
    }
    options
}

#[test]
fn the_public_interface_reads_every_file() {
    let mut faults = Vec::new();
    for (name, truth) in truths() {
        let path = lab_files().join(&name);
        let import = import(&truth.options);
        let fault = match truth.kind.as_str() {
            "frf" => FrfTable::import(&path, &import)
                .map(|_| None)
                .map_err(|error| error.to_string()),
            "refused" => match Recording::import_all(&path, &import) {
                Ok(_) => Err("it is read, and should be refused".into()),
                Err(_) => Ok(None),
            },
            _ => Recording::import_all(&path, &import)
                .map(|records| wrong_samples(&records[0].recording, records.len(), &truth))
                .map_err(|error| error.to_string()),
        };
        match fault {
            Ok(None) => {}
            Ok(Some(what)) | Err(what) => faults.push(format!("{name}: {what}")),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The first difference between a recording and its truth.
fn wrong_samples(recording: &Recording, records: usize, truth: &Truth) -> Option<String> {
    if records != truth.records {
        return Some(format!("{records} records, and {} are true", truth.records));
    }
    if (recording.sample_rate_hz / truth.rate_hz - 1.0).abs() > 1e-4 {
        return Some(format!(
            "{} samples/s, and {} is true",
            recording.sample_rate_hz, truth.rate_hz
        ));
    }
    for (name, channel) in &truth.channels {
        let Some(found) = recording.channel(name) else {
            return Some(recording.lacks(format!("channel {name}")).to_string());
        };
        if found.samples.len() != truth.samples {
            return Some(format!("{name} has {} samples", found.samples.len()));
        }
        // The tolerance covers the digits of the file.
        let tolerance = truth.relative_tolerance * channel.peak;
        for (sample, expected) in found.samples[10..20].iter().zip(&channel.samples_10_to_20) {
            if (sample - expected).abs() > tolerance {
                return Some(format!("{name}: {sample}, and {expected} is true"));
            }
        }
    }
    None
}

#[test]
fn look_shows_every_file_and_its_message_names_the_option() {
    let mut faults = Vec::new();
    let mut count = 0;
    for (name, truth) in truths() {
        count += 1;
        faults.extend(fault_of_look(&name, &truth).map(|what| format!("{name}: {what}")));
    }
    assert!(count >= 40, "{count} files");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The first fault of `quietcut look` with a file.
fn fault_of_look(name: &str, truth: &Truth) -> Option<String> {
    let folder = folder();
    std::fs::copy(lab_files().join(name), folder.path().join(name)).expect("a copy");
    let look = |options: &[String]| {
        let mut arguments = vec!["look", name, "--json"];
        arguments.extend(options.iter().map(String::as_str));
        quietcut(folder.path(), &arguments)
    };
    if !truth.asks.is_empty() {
        let refused = look(&[]);
        if refused.status != Some(2) {
            return Some(format!("without options: {refused:?}"));
        }
        if let Some(words) = truth.asks.iter().find(|words| !refused.stderr.contains(*words)) {
            return Some(format!("the message lacks \"{words}\": {}", refused.stderr));
        }
        if truth.kind == "refused" {
            return None;
        }
        let options = proposed(&refused.stderr);
        let mended = look(&options);
        if mended.status != Some(0) {
            return Some(format!("with the proposed options {options:?}: {mended:?}"));
        }
    }
    let shown = look(&truth.options);
    if shown.status != Some(0) {
        return Some(format!("{shown:?}"));
    }
    let answer: serde_json::Value = serde_json::from_str(&shown.stdout).expect("one JSON object");
    if truth.kind == "frf" {
        return wrong_table(&answer["tables"][0], truth);
    }
    if let Some(what) = wrong_record(&answer, truth) {
        return Some(what);
    }
    if truth.options.is_empty() {
        return None;
    }
    // The sidecar states what the options stated.
    let mut options = truth.options.clone();
    options.push("--write-sidecar".into());
    let written = look(&options);
    if written.status != Some(0) {
        return Some(format!("--write-sidecar: {written:?}"));
    }
    let again = look(&[]);
    if again.status != Some(0) {
        return Some(format!("with the sidecar: {again:?}"));
    }
    let answer: serde_json::Value = serde_json::from_str(&again.stdout).expect("one JSON object");
    if let Some(what) = wrong_record(&answer, truth) {
        return Some(format!("with the sidecar: {what}"));
    }
    (look(&options).status != Some(2)).then(|| "an existing sidecar is overwritten".into())
}

/// The first difference between the answer of `look` and the truth.
fn wrong_record(answer: &serde_json::Value, truth: &Truth) -> Option<String> {
    let records = answer["records"].as_array().map_or(0, Vec::len);
    if records != truth.records {
        return Some(format!("{records} records, and {} are true", truth.records));
    }
    let record = &answer["records"][0];
    if record["samples"].as_u64() != Some(truth.samples as u64) {
        return Some(format!("{} samples", record["samples"]));
    }
    let warnings = record["warnings"].to_string();
    if let Some(words) = truth.warns.iter().find(|words| !warnings.contains(*words)) {
        return Some(format!("no warning with \"{words}\": {warnings}"));
    }
    if truth.warns.is_empty() && !record["warnings"].is_null() {
        return Some(format!("warnings without a reason: {warnings}"));
    }
    for (name, channel) in &truth.channels {
        let channels = record["channels"].as_array();
        let Some(found) = channels
            .into_iter()
            .flatten()
            .find(|found| found["channel"] == name.as_str())
        else {
            return Some(format!("no channel {name}: {}", record["channels"]));
        };
        // The tolerance covers the digits of the file.
        let tolerance = truth.relative_tolerance * channel.peak;
        let is_near = |key: &str, expected: f64| {
            found[key]
                .as_f64()
                .is_some_and(|value| (value - expected).abs() <= tolerance)
        };
        if !is_near("first", channel.first) || !is_near("peak", channel.peak) {
            return Some(format!(
                "{name}: {found}, and {} and {} are true",
                channel.first, channel.peak
            ));
        }
        if found["constant"].as_bool() != Some(truth.constant.contains(name)) {
            return Some(format!("{name}: constant is {}", found["constant"]));
        }
    }
    None
}

/// The first difference between a table in the answer of `look` and the truth.
fn wrong_table(table: &serde_json::Value, truth: &Truth) -> Option<String> {
    for (name, receptance) in &truth.receptances {
        let entries = table["receptances"].as_array();
        let Some(found) = entries
            .into_iter()
            .flatten()
            .find(|found| found["name"] == name.as_str())
        else {
            return Some(format!("no receptance {name}: {table}"));
        };
        let is_near = |key: &str, expected: f64| {
            found[key]
                .as_f64()
                .is_some_and(|value| (value / expected - 1.0).abs() <= truth.relative_tolerance)
        };
        if !is_near("peak_hz", receptance.peak_hz) || !is_near("peak_m_per_n", receptance.peak_m_per_n) {
            return Some(format!(
                "{name}: {found}, and {} m/N at {} Hz is true",
                receptance.peak_m_per_n, receptance.peak_hz
            ));
        }
    }
    None
}
