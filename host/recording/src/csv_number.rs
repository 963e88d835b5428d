//! Parser of the number at the start of a field of a CSV file, and the separator after it.

/// Separator after a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// Comma: another field follows.
    Field,
    /// End of the line or of the file.
    Line,
}

/// Parses the number at the start of `text`, CSV text from the start of a field on, with optional blanks and quotes.
/// Returns its value, the number of bytes up to and including the separator, and the separator; `None` if there is no
/// number, or anything but a separator after it.
#[inline]
pub(super) fn number(text: &[u8]) -> Option<(f64, usize, End)> {
    // Fast path: most numbers have no blanks or quotes around them.
    if let Ok((value, length)) = fast_float2::parse_partial::<f64, _>(text) {
        match &text[length..] {
            [b',', ..] => return Some((value, length + 1, End::Field)),
            [b'\n', ..] => return Some((value, length + 1, End::Line)),
            [] => return Some((value, length, End::Line)),
            _ => {}
        }
    }
    let blanks = |text: &[u8]| {
        text.iter()
            .take_while(|byte| matches!(byte, b' ' | b'\t' | b'\r'))
            .count()
    };
    let mut at = blanks(text);
    let is_quoted = text.get(at) == Some(&b'"');
    if is_quoted {
        at += 1;
        at += blanks(&text[at..]);
    }
    let (value, length) = fast_float2::parse_partial::<f64, _>(&text[at..]).ok()?;
    at += length;
    at += blanks(&text[at..]);
    if is_quoted {
        if text.get(at) != Some(&b'"') {
            return None;
        }
        at += 1;
        at += blanks(&text[at..]);
    }
    match text.get(at) {
        Some(b',') => Some((value, at + 1, End::Field)),
        Some(b'\n') => Some((value, at + 1, End::Line)),
        None => Some((value, at, End::Line)),
        Some(_) => None,
    }
}
