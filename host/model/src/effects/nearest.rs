//! The known word that is closest to an unknown one.

/// Least number of letters to insert, delete or replace that turns one word into the other (Levenshtein distance).
fn edit_distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[to.len()]
}

/// The known word closest to `word`: if `word` is not empty and exactly one known word begins with it, that one.
/// Otherwise the first with the least edit distance among those whose distance is below half the number of their
/// letters; `None` if there are none.
pub(crate) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let known: Vec<&str> = known.into_iter().collect();
    let mut beginning = known.iter().filter(|known| known.starts_with(word));
    if let (false, Some(only), None) = (word.is_empty(), beginning.next(), beginning.next()) {
        return Some(only);
    }
    known
        .into_iter()
        .map(|known| (edit_distance(word, known), known))
        .filter(|(distance, known)| 2 * distance < known.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// The known words as text for a message: the word closest to `word` first, if there is one, then all.
pub(crate) fn expected<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let all = known.join(", ");
    match nearest(word, known) {
        Some(closest) => format!("{closest} (the closest), or one of {all}"),
        None => format!("one of {all}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_word_is_found_and_a_distant_one_is_not() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        let known = ["cubic-stiffness", "cubic-damping", "drift"];
        assert_eq!(nearest("cubic-stifness", known), Some("cubic-stiffness"));
        assert_eq!(nearest("drfit", known), Some("drift"));
        assert_eq!(nearest("weather", known), None);
    }
}
