//! The crates of the workspace, and the crates that each may use.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Each crate with the crates of the workspace that it may use.
const LAYERS: [(&str, &[&str]); 13] = [
    ("quietcut-core", &[]),
    ("quietcut-firmware", &["quietcut-core"]),
    ("quietcut-numerics", &[]),
    ("quietcut-recording", &["quietcut-core", "quietcut-numerics"]),
    (
        "quietcut-model",
        &["quietcut-core", "quietcut-numerics", "quietcut-recording"],
    ),
    (
        "quietcut-frf",
        &["quietcut-numerics", "quietcut-recording", "quietcut-model"],
    ),
    (
        "quietcut-simulate",
        &[
            "quietcut-core",
            "quietcut-numerics",
            "quietcut-recording",
            "quietcut-model",
        ],
    ),
    (
        "quietcut-stability",
        &[
            "quietcut-core",
            "quietcut-numerics",
            "quietcut-recording",
            "quietcut-model",
            "quietcut-frf",
        ],
    ),
    (
        "quietcut-identify",
        &[
            "quietcut-numerics",
            "quietcut-recording",
            "quietcut-model",
            "quietcut-frf",
            "quietcut-simulate",
            "quietcut-stability",
        ],
    ),
    (
        "quietcut-diagnose",
        &[
            "quietcut-core",
            "quietcut-numerics",
            "quietcut-recording",
            "quietcut-model",
            "quietcut-frf",
            "quietcut-simulate",
            "quietcut-stability",
        ],
    ),
    (
        "quietcut",
        &[
            "quietcut-core",
            "quietcut-firmware",
            "quietcut-numerics",
            "quietcut-recording",
            "quietcut-model",
            "quietcut-frf",
            "quietcut-simulate",
            "quietcut-stability",
            "quietcut-identify",
            "quietcut-diagnose",
        ],
    ),
    ("quietcut-testkit", &["quietcut-model", "quietcut-numerics"]),
    (
        "quietcut-tests",
        &["quietcut", "quietcut-core", "quietcut-firmware"],
    ),
];

/// A crate of the workspace.
pub(crate) struct Member {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    manifest: toml::Table,
}

impl Member {
    fn read(folder: PathBuf) -> Self {
        let text = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let manifest: toml::Table = text.parse().unwrap();
        let name = manifest["package"]["name"].as_str().unwrap().to_owned();
        Self {
            name,
            folder,
            manifest,
        }
    }

    /// The root files of the crate's library and programs, the library first, and of its tests that consist of several files.
    pub(crate) fn roots(&self) -> Vec<PathBuf> {
        let source = self.folder.join("src");
        let mut roots = vec![source.join("lib.rs"), source.join("main.rs")];
        let programs = std::fs::read_dir(source.join("bin"))
            .into_iter()
            .flatten()
            .flatten();
        for program in programs.map(|entry| entry.path()) {
            roots.extend([program.join("main.rs"), program]);
        }
        let path_of = |target: &toml::Value| Some(self.folder.join(target.get("path")?.as_str()?));
        roots.extend(self.manifest.get("lib").and_then(path_of));
        let tests = self.manifest.get("test").and_then(toml::Value::as_array);
        let tests = tests.into_iter().flatten().filter_map(path_of);
        roots.extend(tests.filter(|path| path.ends_with("main.rs")));
        roots.retain(|path| path.is_file());
        roots.sort_by_key(|path| !path.ends_with("lib.rs"));
        roots
    }

    /// The crates of the workspace on which the crate depends, without dev-dependencies.
    fn uses(&self) -> Vec<String> {
        let Some(table) = self.manifest.get("dependencies").and_then(toml::Value::as_table) else {
            return Vec::new();
        };
        table
            .keys()
            .filter(|name| name.starts_with("quietcut"))
            .cloned()
            .collect()
    }
}

/// The root of the workspace. Cargo sets the folder of the tests at run time too, so that a built test can check another
/// checkout.
pub(crate) fn root() -> PathBuf {
    let tests = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_else(|_| env!("CARGO_MANIFEST_DIR").to_owned());
    Path::new(&tests).join("..").canonicalize().unwrap()
}

/// All crates of the workspace.
pub(crate) fn all() -> Vec<Member> {
    let text = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let manifest: toml::Table = text.parse().unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap();
    members
        .iter()
        .map(|member| Member::read(root().join(member.as_str().unwrap())))
        .collect()
}

#[test]
fn crates_know_only_the_layers_below_them() {
    let layers: BTreeMap<&str, &[&str]> = LAYERS.into_iter().collect();
    for member in all() {
        let allowed = layers
            .get(member.name.as_str())
            .unwrap_or_else(|| panic!("{} has no layer: add it to the table", member.name));
        for other in member.uses() {
            assert!(
                allowed.contains(&other.as_str()),
                "{} must not know {other}",
                member.name
            );
        }
    }
}

/// The crates of model and stability must run without a file system, for example in a browser.
#[test]
fn model_and_stability_open_no_file() {
    for member in all() {
        if !["quietcut-stability", "quietcut-model"].contains(&member.name.as_str()) {
            continue;
        }
        for path in crate::size::sources(&member.folder.join("src")) {
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap();
            assert!(!code.contains("std::fs"), "{} opens files", path.display());
        }
    }
}

/// `cargo run` of the README chooses among the programs of all members: one alone may name its program.
#[test]
fn cargo_run_starts_the_command() {
    let named: Vec<String> = all()
        .iter()
        .filter_map(|member| {
            member.manifest["package"]
                .get("default-run")?
                .as_str()
                .map(str::to_owned)
        })
        .collect();
    assert_eq!(named, ["quietcut"]);
}
