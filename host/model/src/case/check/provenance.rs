//! Check of the section `[provenance]` of a case.

use toml::Spanned;

use super::Check;
use crate::case::CaseError;
use crate::structure::Direction;

impl Check<'_> {
    /// Names of receptances: h, the direction of the displacement and that of the force.
    pub(super) fn receptances(&self, names: &[Spanned<String>]) -> Result<Vec<String>, CaseError> {
        let is_receptance = |name: &str| {
            let directions = || Direction::ALL.iter().map(|direction| direction.name());
            directions().any(|response| directions().any(|force| name == format!("h{response}{force}")))
        };
        let checked = |name: &Spanned<String>| {
            let text = name.get_ref();
            if is_receptance(text) {
                return Ok(text.clone());
            }
            let expected = "the name of a receptance, such as \"hxy\" (displacement x, force y),";
            Err(self.wrong(
                name,
                "provenance.zero_receptances",
                format!("\"{text}\""),
                expected,
            ))
        };
        names.iter().map(checked).collect()
    }
}
