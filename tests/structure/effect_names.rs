//! The name of an effect stands in its specification and nowhere else: code that needs it takes it from `EffectName`.

use std::collections::BTreeMap;
use std::path::Path;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::Item;

use crate::crates::{all, root};
use crate::module::{attributes_of, is_of_tests};
use crate::size::sources;

/// Folder of the effects, from the root of the workspace.
const EFFECTS: &str = "host/model/src/effects";

/// Matrices of a case, which are names of effects too.
const MATRICES: &[&str] = &["mass", "damping", "stiffness"];

/// Words that are names of an effect and of something else: the file, the words, and the other thing.
const OTHER_MEANINGS: &[(&str, &[&str], &str)] = &[
    ("host/identify/src/case_file.rs", MATRICES, "matrix of a case"),
    (
        "host/model/src/case/check/structure.rs",
        MATRICES,
        "matrix of a case",
    ),
    ("host/model/src/case/deviation.rs", MATRICES, "matrix of a case"),
    (
        "host/model/src/structure/definiteness.rs",
        MATRICES,
        "matrix of a case",
    ),
    ("host/src/report/words.rs", &["runout"], "verdict of the device"),
    (
        "host/stability/src/methods/mode_coupling.rs",
        &["mode-coupling"],
        "method of stability",
    ),
];

/// Text literals of code that is not compiled for tests only.
fn literals(items: &[Item]) -> Vec<String> {
    let mut found = Vec::new();
    for item in items {
        match item {
            Item::Mod(item) if is_of_tests(&item.attrs) => {}
            Item::Mod(item) => {
                if let Some((_, items)) = &item.content {
                    found.extend(literals(items));
                }
            }
            item if is_of_tests(attributes_of(item)) => {}
            item => texts_of(item.to_token_stream(), &mut found),
        }
    }
    found
}

fn texts_of(tokens: TokenStream, found: &mut Vec<String>) {
    for token in tokens {
        match token {
            TokenTree::Literal(literal) => {
                if let Ok(text) = syn::parse2::<syn::LitStr>(TokenTree::from(literal).into()) {
                    found.push(text.value());
                }
            }
            TokenTree::Group(group) => texts_of(group.stream(), found),
            _ => {}
        }
    }
}

/// Text literals that follow `name:` in a specification.
fn names_of(tokens: TokenStream, found: &mut Vec<String>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    for window in tokens.windows(3) {
        if let [TokenTree::Ident(word), TokenTree::Punct(mark), literal] = window
            && word == "name"
            && mark.as_char() == ':'
            && let Ok(text) = syn::parse2::<syn::LitStr>(literal.clone().into())
        {
            found.push(text.value());
        }
    }
    for token in tokens {
        if let TokenTree::Group(group) = token {
            names_of(group.stream(), found);
        }
    }
}

fn parsed(path: &Path) -> syn::File {
    let text = std::fs::read_to_string(path).unwrap();
    syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Names of all effects, with the number of their specifications.
fn names(effects: &Path) -> BTreeMap<String, usize> {
    let mut names = BTreeMap::new();
    for path in sources(effects) {
        for item in parsed(&path).items {
            if let Item::Const(item) = item {
                let mut found = Vec::new();
                names_of(item.expr.to_token_stream(), &mut found);
                for name in found {
                    *names.entry(name).or_default() += 1;
                }
            }
        }
    }
    names
}

/// Names of effects outside their specifications below a folder: file, relative to `root`, and name.
fn second_definitions(root: &Path, folder: &Path, names: &BTreeMap<String, usize>) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let effects = root.join(EFFECTS);
    for path in sources(folder) {
        let mut literals = literals(&parsed(&path).items);
        if path.starts_with(&effects) {
            // One literal of each name is its specification.
            for name in names.keys() {
                if let Some(own) = specification(&path, name) {
                    let index = literals.iter().position(|literal| *literal == own);
                    index.map(|index| literals.swap_remove(index));
                }
            }
        }
        let file = path.strip_prefix(root).unwrap().display().to_string();
        for literal in literals.into_iter().filter(|literal| names.contains_key(literal)) {
            if !found.contains(&(file.clone(), literal.clone())) {
                found.push((file.clone(), literal));
            }
        }
    }
    found
}

/// `name`, if the file at `path` specifies it.
fn specification(path: &Path, name: &str) -> Option<String> {
    let mut found = Vec::new();
    for item in parsed(path).items {
        if let Item::Const(item) = item {
            names_of(item.expr.to_token_stream(), &mut found);
        }
    }
    found.into_iter().find(|own| own == name)
}

#[test]
fn the_name_of_an_effect_stands_in_its_specification_alone() {
    let root = root();
    let names = names(&root.join(EFFECTS));
    assert!(names.len() > 20, "{names:?}");
    let twice: Vec<_> = names.iter().filter(|(_, count)| **count > 1).collect();
    assert!(twice.is_empty(), "specified twice: {twice:?}");
    let (mut second, mut excused) = (String::new(), Vec::new());
    for member in all() {
        let folder = member.folder.join("src");
        // The device knows no effects.
        if !folder.exists() || !folder.starts_with(root.join("host")) {
            continue;
        }
        for (file, name) in second_definitions(&root, &folder, &names) {
            match OTHER_MEANINGS
                .iter()
                .find(|(known, words, _)| *known == file && words.contains(&name.as_str()))
            {
                Some((known, ..)) => excused.push((*known, name.clone())),
                None => second += &format!("{file}: \"{name}\"\n"),
            }
        }
    }
    assert!(
        second.is_empty(),
        "names of effects written a second time:\n{second}"
    );
    let not_needed: Vec<_> = OTHER_MEANINGS
        .iter()
        .flat_map(|(known, words, _)| words.iter().map(move |word| (*known, (*word).to_owned())))
        .filter(|excuse| !excused.contains(excuse))
        .collect();
    assert!(not_needed.is_empty(), "not needed, remove: {not_needed:?}");
}

#[test]
fn a_second_definition_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |path: &str, text: &str| {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    let specification = |name: &str| {
        format!(
            "pub const SPEC: EffectSpec = EffectSpec {{ name: \"{name}\", parameters: &[P::number(\"k\")] }};"
        )
    };
    write("host/model/src/effects/rattle.rs", &specification("rattle-noise"));
    write(
        "host/model/src/effects/creep.rs",
        &(specification("creep") + "fn other() -> &'static str { \"rattle-noise\" }"),
    );
    write(
        "host/model/src/other.rs",
        "//! \"creep\"\n/// \"creep\"\nfn f(a: &str) -> bool { matches!(a, \"creep\") }
         #[cfg(test)] mod tests { fn g() -> &'static str { \"rattle-noise\" } }",
    );
    write("host/model/src/tests.rs", "fn g() -> &'static str { \"creep\" }");
    let names = names(&folder.path().join(EFFECTS));
    assert_eq!(
        names,
        [("creep".to_owned(), 1), ("rattle-noise".to_owned(), 1)].into()
    );
    let mut found = second_definitions(folder.path(), &folder.path().join("host/model/src"), &names);
    found.sort();
    let expected = [
        ("host/model/src/effects/creep.rs", "rattle-noise"),
        ("host/model/src/other.rs", "creep"),
    ];
    assert_eq!(
        found,
        expected.map(|(file, name)| (file.to_owned(), name.to_owned()))
    );
}
