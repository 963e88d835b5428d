//! The module tree of a crate, with the definitions and imports of each module.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use quote::ToTokens;
use syn::{Attribute, Item, ItemMod, UseTree, Visibility};

use crate::tokens::{paths_of, words_of};

/// A module: a file, or a part of a file in braces.
#[derive(Debug, Default)]
pub(crate) struct Module {
    /// The file that contains the module, relative to the root of the sources.
    pub(crate) file: PathBuf,
    /// The submodules, by name.
    pub(crate) children: BTreeMap<String, Module>,
    /// Names that the module defines.
    pub(crate) defined: Vec<String>,
    /// Names that the module imports, with their paths. A glob import has the name `*`.
    pub(crate) imported: Vec<Import>,
    /// Paths of two or more segments in the code of the module.
    pub(crate) paths: Vec<Vec<String>>,
    /// All identifiers in the code of the module outside of `use` declarations.
    pub(crate) words: Vec<String>,
}

/// One name of a `use` declaration.
#[derive(Debug)]
pub(crate) struct Import {
    pub(crate) name: String,
    pub(crate) path: Vec<String>,
    /// True if other modules can import the name from this one.
    pub(crate) is_reexport: bool,
}

/// Reads the module tree of a crate from its root file.
pub(crate) fn read(root: &Path) -> Module {
    let folder = root.parent().unwrap();
    let mut module = Module {
        file: PathBuf::from(root.file_name().unwrap()),
        ..Module::default()
    };
    fill(&mut module, folder, Path::new(""), &parsed(root).items);
    module
}

fn parsed(path: &Path) -> syn::File {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// True if an item is compiled for tests only.
pub(crate) fn is_of_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = attribute.to_token_stream().to_string().replace(' ', "");
        text == "#[test]" || text.starts_with("#[cfg(test") || text.starts_with("#[cfg(all(test")
    })
}

/// Adds items to a module. `below` is the folder of its submodules, relative to `folder`.
fn fill(module: &mut Module, folder: &Path, below: &Path, items: &[Item]) {
    for item in items {
        match item {
            Item::Mod(item) if !is_of_tests(&item.attrs) => {
                let child = child(item, &module.file, folder, below);
                module.children.insert(item.ident.to_string(), child);
            }
            Item::Mod(_) => {}
            Item::Use(item) if !is_of_tests(&item.attrs) => {
                let is_reexport = !matches!(item.vis, Visibility::Inherited);
                imports(&item.tree, &mut Vec::new(), is_reexport, &mut module.imported);
            }
            Item::Use(_) => {}
            item => {
                if !is_of_tests(attributes_of(item)) {
                    let tokens = item.to_token_stream();
                    module.defined.extend(name_of(item));
                    paths_of(tokens.clone(), &mut module.paths);
                    words_of(tokens, &mut module.words);
                }
            }
        }
    }
}

fn child(item: &ItemMod, file: &Path, folder: &Path, below: &Path) -> Module {
    let name = item.ident.to_string();
    let mut module = Module::default();
    if let Some((_, items)) = &item.content {
        module.file = file.to_owned();
        fill(&mut module, folder, &below.join(&name), items);
        return module;
    }
    let own = [below.join(format!("{name}.rs")), below.join(&name).join("mod.rs")];
    let found = own.into_iter().find(|path| folder.join(path).exists());
    module.file = found.unwrap_or_else(|| panic!("module {name} of {} has no file", file.display()));
    let items = parsed(&folder.join(&module.file)).items;
    fill(&mut module, folder, &below.join(&name), &items);
    module
}

fn imports(tree: &UseTree, path: &mut Vec<String>, is_reexport: bool, found: &mut Vec<Import>) {
    let mut end = |name: String, last: Option<String>, path: &[String]| {
        let mut path = path.to_vec();
        // `self` at the end of a list names the module before it.
        path.extend(last.filter(|last| last != "self" || path.is_empty()));
        let name = if name == "self" {
            path.last().cloned().unwrap_or(name)
        } else {
            name
        };
        found.push(Import {
            name,
            path,
            is_reexport,
        });
    };
    match tree {
        UseTree::Path(tree) => {
            path.push(tree.ident.to_string());
            imports(&tree.tree, path, is_reexport, found);
            path.pop();
        }
        UseTree::Name(tree) => end(tree.ident.to_string(), Some(tree.ident.to_string()), path),
        UseTree::Rename(tree) => end(tree.rename.to_string(), Some(tree.ident.to_string()), path),
        UseTree::Glob(_) => end("*".to_owned(), None, path),
        UseTree::Group(tree) => {
            for tree in &tree.items {
                imports(tree, path, is_reexport, found);
            }
        }
    }
}

pub(crate) fn attributes_of(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        _ => &[],
    }
}

fn name_of(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(ident.to_string())
}
