//! An effect that the test adds.

use crate::copy_of_the_tree::CopyOfTheTree;

/// The crates' lists.
const MODEL: &str = "host/model/src/effects";
const DIAGNOSE: &str = "host/diagnose/src/candidates";

/// An effect that quietcut does not have, and how the guide adds it.
pub(crate) struct NewEffect {
    /// Name in cases and on the command line.
    pub(crate) name: &'static str,
    /// Name of its files and modules.
    pub(crate) module: &'static str,
    /// The module that follows in the order of the alphabet.
    pub(crate) next_module: &'static str,
    /// Entry in the list of effects.
    pub(crate) entry: &'static str,
    /// Arm of the match over effects.
    pub(crate) arm: &'static str,
}

impl NewEffect {
    /// Step 1 and 2 of the guide: the file of the effect, its module and its entry in the list.
    pub(crate) fn add_to_model(&self, copy: &CopyOfTheTree) {
        let module = self.module;
        copy.add(&format!("model/{module}.rs.txt"), &format!("{MODEL}/{module}.rs"));
        let list = format!("{MODEL}/mod.rs");
        copy.insert(
            &list,
            &format!("mod {module};"),
            &format!("mod {};", self.next_module),
        );
        copy.insert(&list, self.entry, "    Mass => mass::MASS,");
    }

    /// Step 3 and 4 of the guide: the file of the candidate causes, its module, and without the last step the arm.
    pub(crate) fn add_to_diagnose_without_arm(&self, copy: &CopyOfTheTree) {
        let module = self.module;
        copy.add(
            &format!("diagnose/{module}.rs.txt"),
            &format!("{DIAGNOSE}/{module}.rs"),
        );
        let list = format!("{DIAGNOSE}/mod.rs");
        copy.insert(
            &list,
            &format!("mod {module};"),
            &format!("mod {};", self.next_module),
        );
    }

    /// The arm of step 4.
    pub(crate) fn add_arm(&self, copy: &CopyOfTheTree) {
        copy.insert(
            &format!("{DIAGNOSE}/mod.rs"),
            self.arm,
            "        EffectName::Mass => vec!",
        );
    }

    /// The new files of the effect, with the number of their lines added and removed.
    pub(crate) fn files(&self) -> [String; 2] {
        let lines = |room: &str| {
            let path = format!(
                "{}/adding_effects/{room}/{}.rs.txt",
                env!("CARGO_MANIFEST_DIR"),
                self.module
            );
            std::fs::read_to_string(path).unwrap().lines().count()
        };
        [("diagnose", DIAGNOSE), ("model", MODEL)]
            .map(|(room, folder)| format!("{} 0 {folder}/{}.rs", lines(room), self.module))
    }
}
