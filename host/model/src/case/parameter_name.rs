//! Names of parameters in the section `[uncertainty]` of a case.

use super::deviation::Parameter;

impl Parameter {
    /// Name of the parameter in `[uncertainty]`: the path of its key, with rows, columns, modes, joints and entries of
    /// mode shapes as numbers from 1, such as `structure.mode.1.right.2.imaginary`.
    pub fn name(self) -> String {
        self.key().replace('[', ".").replace(']', "").replace(' ', ".")
    }
}
