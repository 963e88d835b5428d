//! The completions of `quietcut completions` in the shell itself.
#![allow(clippy::unwrap_used)]

use std::process::Command;

use quietcut_tests::command::{done, folder, verbs};

/// Words that bash proposes after `line`.
fn proposed(script: &str, line: &str) -> String {
    let folder = folder();
    let file = folder.path().join("completions.bash");
    std::fs::write(&file, script).unwrap();
    let words: Vec<&str> = line.split(' ').collect();
    let last = words.len() - 1;
    let program = format!(
        "source {file}; COMP_WORDS=({line}); [ {count} -le {last} ] && COMP_WORDS+=(''); COMP_CWORD={last}; \
         _quietcut quietcut \"${{COMP_WORDS[{last}]}}\" \"${{COMP_WORDS[{before}]}}\"; echo \"${{COMPREPLY[@]}}\"",
        file = file.display(),
        count = line.split_whitespace().count(),
        before = last - 1,
    );
    let output = Command::new("bash")
        .args(["--norc", "-c", &program])
        .output()
        .unwrap();
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap().trim().into()
}

#[test]
fn bash_completes_verbs_and_options() {
    let folder = folder();
    let script = done(folder.path(), "completions bash").stdout;
    let file = folder.path().join("checked.bash");
    std::fs::write(&file, &script).unwrap();
    assert!(
        Command::new("bash")
            .arg("-n")
            .arg(&file)
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(proposed(&script, "quietcut moni"), "monitor");
    assert_eq!(proposed(&script, "quietcut monitor simulated --we"), "--web");
    let all = proposed(&script, "quietcut ");
    for verb in verbs() {
        assert!(all.split(' ').any(|word| word == verb), "{verb} is not in {all}");
    }
}

#[test]
fn each_shell_has_a_script_with_each_verb() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = done(folder.path(), &format!("completions {shell}")).stdout;
        for verb in verbs() {
            assert!(script.contains(&verb), "{shell}: {verb}");
        }
    }
}
