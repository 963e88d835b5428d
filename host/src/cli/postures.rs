//! Postures of a lobe table: the posture of a working point must be one of them.

use std::collections::BTreeSet;
use std::path::Path;

use quietcut_core::lobes::{Header, LobeTable};

use super::Error;

/// Smallest writable unit of the flash memory, bytes.
const WORD: usize = 8;

/// Postures of the lobe table in `bytes`, ascending; an error names the file `path`.
pub(super) fn of_table(path: &Path, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let table = LobeTable::parse(bytes)
        .map_err(|error| Error::input(format!("{}: this is no lobe table: {error}", path.display())))?;
    Ok(postures(&table))
}

/// Postures, ascending, of the lobe table with the highest generation number in the memory file of the simulated
/// device; `None` if the file cannot be read or holds no valid lobe table.
pub(super) fn of_state(path: &Path) -> Option<Vec<u8>> {
    let bytes = crate::file::read(path).ok()?;
    // The firmware begins a lobe table at a multiple of a word of the flash memory.
    let tables = (0..bytes.len()).step_by(WORD).filter_map(|at| {
        let rest = &bytes[at..];
        let header = Header::read(rest).ok()?;
        let table = LobeTable::parse(rest.get(..header.length as usize)?).ok()?;
        Some((header.generation, postures(&table)))
    });
    tables
        .max_by_key(|(generation, _)| *generation)
        .map(|(_, postures)| postures)
}

fn postures(table: &LobeTable<'_>) -> Vec<u8> {
    let postures: BTreeSet<u8> = table.layers().map(|layer| layer.posture).collect();
    postures.into_iter().collect()
}

/// Refuses a posture that is not among the postures `known` of the lobe table; `None` accepts every posture.
pub(super) fn check(posture: u8, known: Option<&[u8]>) -> Result<(), Error> {
    let Some(known) = known.filter(|known| !known.contains(&posture)) else {
        return Ok(());
    };
    let listed: Vec<String> = known.iter().map(ToString::to_string).collect();
    Err(Error::input(format!(
        "--posture {posture}: the lobe table has no layer of this posture, but of {}; the key posture.index of a case sets it",
        listed.join(", ")
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_posture_must_be_one_of_the_table() {
        assert!(check(0, None).is_ok() && check(7, None).is_ok() && check(3, Some(&[1, 3])).is_ok());
        let said = check(99, Some(&[0, 3])).unwrap_err().to_string();
        assert!(said.contains("--posture 99") && said.contains("0, 3"), "{said}");
    }
}
