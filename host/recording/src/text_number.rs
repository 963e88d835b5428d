//! Numbers in the fields of a text table, in the notations that programs and countries use.

use super::time_stamp::seconds;

/// Words in lower case that loggers, oscilloscopes and spreadsheets write where there is no value.
const NO_VALUE: &[&str] = &[
    "-",
    "--",
    "---",
    "n/a",
    "na",
    "#n/a",
    "null",
    "none",
    "ovr",
    "over",
    "overload",
    "ovl",
    "ovld",
    "overflow",
    "underflow",
    "open",
    "invalid",
    "err",
    "error",
    "#num!",
    "#div/0!",
    "#value!",
];

/// True if the field of a text table is empty, or a word that stands where there is no value.
pub(super) fn is_no_value(field: &str) -> bool {
    field.is_empty() || NO_VALUE.iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// Number in a field of a text table; `None` if the field is no number in this notation.
///
/// Besides decimals with an exponent these are read: groups of three digits (`1,234.5`, with decimal comma `1.234,5`),
/// the exponent `D` of Fortran, the sign `∞`, and times (`12:00:01.5`, `2024-05-03T12:00:01.5Z`) as seconds.
pub(super) fn number(field: &str, decimal_comma: bool) -> Option<f64> {
    let plain = |text: &str| fast_float2::parse::<f64, _>(text).ok();
    let has_comma = field.contains(',');
    if !(decimal_comma && has_comma)
        && let Some(value) = plain(field)
    {
        return Some(value);
    }
    let (group, mark) = if decimal_comma { ('.', ',') } else { (',', '.') };
    let text = match ungrouped(field, group, mark) {
        Some(text) => text,
        None if has_comma && (!decimal_comma || field.contains('.')) => {
            return seconds(field, decimal_comma);
        }
        None => field.to_owned(),
    };
    let text = if decimal_comma {
        text.replace(',', ".")
    } else {
        text
    };
    if let Some(value) = plain(&text) {
        return Some(value);
    }
    match text.trim_start_matches(['+', '-']) {
        "∞" => {
            return Some(if text.starts_with('-') {
                f64::NEG_INFINITY
            } else {
                f64::INFINITY
            });
        }
        digits if digits.starts_with(|first: char| first.is_ascii_digit() || first == '.') => {}
        _ => return None,
    }
    plain(&text.replacen(['d', 'D'], "e", 1)).or_else(|| seconds(field, decimal_comma))
}

/// Real and imaginary part of a complex number as MATLAB, NumPy and spreadsheets write it: `1.5e-7-2e-9i`,
/// `(1.5e-07-2e-09j)`; `None` for other text.
pub(super) fn complex(field: &str) -> Option<(&str, &str)> {
    let field = field.trim();
    let inner = field
        .strip_prefix('(')
        .and_then(|inner| inner.strip_suffix(')'))
        .unwrap_or(field);
    let parts = inner.strip_suffix(['i', 'j'])?;
    let is_sign = |at: &usize| {
        let before = parts[..*at].chars().next_back();
        before.is_some_and(|before| before.is_ascii_digit() || before == '.' || before == ' ')
    };
    let at = parts.rmatch_indices(['+', '-']).map(|(at, _)| at).find(is_sign)?;
    let (real, imaginary) = parts.split_at(at);
    let is_number = |text: &str| fast_float2::parse::<f64, _>(text).is_ok();
    (is_number(real.trim()) && is_number(imaginary)).then_some((real.trim(), imaginary))
}

/// The number without the marks between its groups of three digits; `None` if it has none, or if they do not stand
/// before every third digit of a whole part.
fn ungrouped(field: &str, group: char, mark: char) -> Option<String> {
    let (whole, rest) = field.split_at(field.find(mark).unwrap_or(field.len()));
    let digits = whole.trim_start_matches(['+', '-']);
    let mut groups = digits.split(group);
    let is_digits = |text: &str| text.chars().all(|letter| letter.is_ascii_digit());
    let first = groups.next()?;
    let mut count = 0;
    for part in groups {
        if part.len() != 3 || !is_digits(part) {
            return None;
        }
        count += 1;
    }
    let is_grouped =
        count > 0 && (1..=3).contains(&first.len()) && is_digits(first) && !first.starts_with('0');
    // A single group without fraction may as well be a decimal number in the other notation.
    let is_certain = count > 1 || !rest.is_empty();
    (is_grouped && is_certain).then(|| whole.replace(group, "") + rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notations_of_programs_and_countries_are_read() {
        for (field, decimal_comma, value) in [
            ("1,234.5", false, Some(1234.5)),
            ("-1,234,567", false, Some(-1_234_567.0)),
            ("12,34.5", false, None),
            ("0,125", false, None),
            ("0,125.5", false, None),
            ("1,234", false, None),
            ("1.234,5", true, Some(1234.5)),
            ("1.234.567,25", true, Some(1_234_567.25)),
            ("1.2345,5", true, None),
            ("1,5", true, Some(1.5)),
            ("-1,5e-3", true, Some(-1.5e-3)),
            ("1.234", true, Some(1.234)),
            ("1.5D-03", false, Some(1.5e-3)),
            ("-2d+2", false, Some(-200.0)),
            ("12:00:01.5", false, Some(43_201.5)),
            ("12:00:01,5", true, Some(43_201.5)),
            ("01:30.25", false, Some(90.25)),
            ("text", false, None),
            ("x1", false, None),
            ("", false, None),
        ] {
            assert_eq!(number(field, decimal_comma), value, "{field}");
        }
        for (field, parts) in [
            ("1.5e-07-2e-09i", Some(("1.5e-07", "-2e-09"))),
            ("(-1.5+2e+00j)", Some(("-1.5", "+2e+00"))),
            ("1.5e-07", None),
            ("2i", None),
            ("pi", None),
        ] {
            assert_eq!(complex(field), parts, "{field}");
        }
        assert_eq!(number("-∞", false), Some(f64::NEG_INFINITY));
        assert!(is_no_value("OVR") && is_no_value("") && !is_no_value("Force"));
    }
}
