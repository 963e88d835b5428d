//! A copy of the tree in a temporary folder, with a target folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// A clone of the tree at its newest commit.
pub(crate) struct CopyOfTheTree {
    folder: TempDir,
}

impl CopyOfTheTree {
    pub(crate) fn new() -> Self {
        let copy = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let root = root.to_str().unwrap();
        copy.succeeds("git", &["clone", "--quiet", "--no-hardlinks", root, "."]);
        copy.take_dependencies();
        copy
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Takes the built external dependencies from the target folder of the running test. Crates of the workspace are not among them: a build
    /// may write into a linked file. Without them the build takes longer, and all else is the same.
    fn take_dependencies(&self) {
        let test = std::env::current_exe().unwrap();
        let outer = test.parent().and_then(Path::parent).unwrap();
        let own = self.path().join("target/release");
        for folder in ["deps", "build", ".fingerprint"] {
            std::fs::create_dir_all(own.join(folder)).unwrap();
            for entry in std::fs::read_dir(outer.join(folder))
                .into_iter()
                .flatten()
                .flatten()
            {
                let name = entry.file_name();
                let (from, to) = (entry.path(), own.join(folder).join(&name));
                if name.to_string_lossy().contains("quietcut") {
                    continue;
                }
                let needs_no_copy =
                    folder == "deps" && (!is_library(&from) || std::fs::hard_link(&from, &to).is_ok());
                if !needs_no_copy {
                    self.succeeds("cp", &["-a", from.to_str().unwrap(), to.to_str().unwrap()]);
                }
            }
        }
    }

    /// The command of the copy.
    pub(crate) fn binary(&self) -> PathBuf {
        self.path().join("target/release/quietcut")
    }

    /// Runs a program in the copy to its end.
    pub(crate) fn run(&self, program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> Output {
        Command::new(program)
            .args(arguments)
            .current_dir(self.path())
            .env("CARGO_TARGET_DIR", self.path().join("target"))
            .output()
            .unwrap()
    }

    /// Runs a program in the copy, which must succeed; returns its standard output.
    #[track_caller]
    pub(crate) fn succeeds(&self, program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> String {
        let output = self.run(program, arguments);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(
            output.status.success(),
            "{arguments:?}: {}\n{}",
            text(&output.stdout),
            text(&output.stderr)
        );
        text(&output.stdout)
    }

    /// Runs the command of the copy with `--json`, and parses its answer.
    #[track_caller]
    pub(crate) fn answers(&self, arguments: &[&str]) -> serde_json::Value {
        let arguments = [arguments, &["--json"]].concat();
        serde_json::from_str(&self.succeeds(self.binary(), &arguments)).unwrap()
    }

    /// Adds a file of this folder under `path`.
    pub(crate) fn add(&self, from: &str, path: &str) {
        let source = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("adding_effects")
            .join(from);
        let target = self.path().join(path);
        assert!(!target.exists(), "{path} is a file of the tree");
        std::fs::copy(source, target).unwrap();
    }

    /// Inserts a line into a file, before the only line that begins with `before`.
    pub(crate) fn insert(&self, path: &str, line: &str, before: &str) {
        let path = self.path().join(path);
        let text = std::fs::read_to_string(&path).unwrap();
        let starts: Vec<usize> = text
            .match_indices(&format!("\n{before}"))
            .map(|(at, _)| at)
            .collect();
        let &[at] = &starts[..] else {
            panic!(
                "{} lines of {} begin with `{before}`",
                starts.len(),
                path.display()
            );
        };
        let (head, tail) = text.split_at(at);
        std::fs::write(path, format!("{head}\n{line}{tail}")).unwrap();
    }

    /// Files that differ from the tree, with the number of lines that were added and removed; untracked files count as added.
    pub(crate) fn changes(&self) -> Vec<String> {
        self.succeeds("git", &["add", "--all"]);
        let changes = self.succeeds("git", &["diff", "--cached", "--numstat"]);
        changes.lines().map(|line| line.replace('\t', " ")).collect()
    }
}

/// True for a built library.
fn is_library(path: &Path) -> bool {
    path.extension()
        .is_some_and(|end| ["rlib", "rmeta", "so"].iter().any(|known| end == *known))
}
