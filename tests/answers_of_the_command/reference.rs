//! The committed reference: one file of questions and answers for each group.

use std::fs;
use std::path::Path;

use crate::json::Json;
use crate::question::Question;

/// Groups of questions that only the full run contains, because each takes minutes.
pub(crate) const ONLY_FULL: [&str; 2] = ["long-diagnoses", "seeded-diagnoses"];

/// Questions with their answers, in the order of the files.
pub(crate) fn read(folder: &Path, full: bool) -> Result<Vec<(Question, Json)>, String> {
    let mut paths: Vec<_> = fs::read_dir(folder)
        .map_err(|error| format!("{}: {error}", folder.display()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|ending| ending == "json"))
        .collect();
    paths.sort();
    for group in ONLY_FULL.iter().filter(|_| full) {
        if !folder.join(format!("{group}.json")).exists() {
            return Err(format!(
                "no reference of {group}: tests/answers --full --record --only {group}"
            ));
        }
    }
    let mut found = Vec::new();
    for path in paths {
        let group = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or_default();
        if ONLY_FULL.contains(&group) && !full {
            continue;
        }
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let Json::List(answers) =
            Json::read(&text).map_err(|error| format!("{}: {error}", path.display()))?
        else {
            return Err(format!("{}: is no list", path.display()));
        };
        found.extend(
            answers
                .into_iter()
                .map(|answer| (Question::of_answer(group, &answer), answer)),
        );
    }
    Ok(found)
}

/// Writes the answers of all groups that have run. Files of other groups are kept.
pub(crate) fn write(folder: &Path, answered: &[(Question, Json)]) -> Result<(), String> {
    let mut groups: Vec<&str> = answered
        .iter()
        .map(|(question, _)| question.group.as_str())
        .collect();
    groups.dedup();
    for group in groups {
        let answers = answered.iter().filter(|(question, _)| question.group == group);
        let list = Json::List(answers.map(|(_, answer)| answer.clone()).collect());
        let path = folder.join(format!("{group}.json"));
        fs::write(&path, list.write() + "\n").map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}
