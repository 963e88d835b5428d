//! The imports between the files of a crate, with the imported names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::module::{self, Module};

/// Largest number of re-exports through which a name is followed.
const DEPTH: usize = 12;

/// Imports between files: for each pair of files, the names that the first uses from the second.
pub(crate) type Arrows = BTreeMap<(PathBuf, PathBuf), BTreeSet<String>>;

/// The imports between the files of the crate with this root file.
pub(crate) fn arrows(root: &Path) -> Arrows {
    let tree = module::read(root);
    let mut arrows = Arrows::new();
    visit(&tree, &tree, &mut Vec::new(), &mut arrows);
    arrows
}

fn visit(tree: &Module, module: &Module, place: &mut Vec<String>, arrows: &mut Arrows) {
    let mut add = |path: &[String]| {
        let Some((file, name)) = resolve(tree, place, path, 0) else {
            return;
        };
        if file != module.file {
            arrows
                .entry((module.file.clone(), file))
                .or_default()
                .insert(name);
        }
    };
    for import in &module.imported {
        // A name that a file only re-exports does not count as an import of the file.
        let is_used = !import.is_reexport || module.words.contains(&import.name);
        if is_used {
            add(&import.path);
        }
    }
    for path in &module.paths {
        add(path);
    }
    for (name, child) in &module.children {
        place.push(name.clone());
        visit(tree, child, place, arrows);
        place.pop();
    }
}

fn at<'a>(tree: &'a Module, place: &[String]) -> Option<&'a Module> {
    place
        .iter()
        .try_fold(tree, |module, name| module.children.get(name))
}

/// The file that defines the name of a path in the module at `place`, and the name; `None` if the name is not of this crate.
fn resolve(tree: &Module, place: &[String], path: &[String], depth: usize) -> Option<(PathBuf, String)> {
    if depth > DEPTH {
        return None;
    }
    let (mut from, mut rest) = match path.first()?.as_str() {
        "crate" => (Vec::new(), &path[1..]),
        "self" => (place.to_vec(), &path[1..]),
        "super" => {
            let ups = path.iter().take_while(|word| *word == "super").count();
            (place[..place.len().checked_sub(ups)?].to_vec(), &path[ups..])
        }
        _ => (place.to_vec(), path),
    };
    loop {
        let module = at(tree, &from)?;
        let Some(name) = rest.first() else {
            return Some((module.file.clone(), "mod".to_owned()));
        };
        if module.children.contains_key(name) {
            from.push(name.clone());
            rest = &rest[1..];
            continue;
        }
        if module.defined.contains(name) {
            return Some((module.file.clone(), name.clone()));
        }
        if let Some(import) = module.imported.iter().find(|import| &import.name == name) {
            // An import that resolves to itself is from another crate.
            if import.path == rest {
                return None;
            }
            let mut onward = import.path.clone();
            onward.extend_from_slice(&rest[1..]);
            return resolve(tree, &from, &onward, depth + 1);
        }
        let globs = module.imported.iter().filter(|import| import.name == "*");
        for glob in globs {
            let mut onward = glob.path.clone();
            onward.extend_from_slice(rest);
            if let Some(found) = resolve(tree, &from, &onward, depth + 1) {
                return Some(found);
            }
        }
        return None;
    }
}
