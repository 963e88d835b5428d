//! Ranges on the command line: evenly spaced values `first:last:count` or `first:last`, and bands `first:last`.

use std::str::FromStr;

use super::number::finite;

/// Evenly spaced values from `first` to `last`, both included; written `first:last:count`, `first:last`, or one number
/// alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    first: f64,
    last: f64,
    count: usize,
}

impl Range {
    /// Upper bound of the number of values in a range, a choice: more values than a chart can show indicate a typing
    /// error.
    const MAX_COUNT: usize = 1_000_000;

    /// Number of values of `first:last` without a count. A choice: steps of a sixtieth of the range are fine in a
    /// chart.
    pub const DEFAULT_COUNT: usize = 61;

    /// First value of the range.
    pub fn first(&self) -> f64 {
        self.first
    }

    /// Last value of the range.
    pub fn last(&self) -> f64 {
        self.last
    }

    /// Number of values in the range, at least 1.
    pub fn count(&self) -> usize {
        self.count
    }

    /// All values of the range in order; the first and the last are exactly those given.
    pub fn values(&self) -> Vec<f64> {
        let steps = self.count.saturating_sub(1).max(1) as f64;
        (0..self.count)
            .map(|i| {
                let share = i as f64 / steps;
                self.first * (1.0 - share) + self.last * share
            })
            .collect()
    }

    /// Number of equal steps from 0 to the larger end of the range, each at most as wide as the width of the range
    /// divided by its number of values; 1 for a single value.
    pub fn steps_from_zero(&self) -> usize {
        let widest = (self.last - self.first).abs() / self.count.max(2) as f64;
        if widest > 0.0 {
            (self.first.max(self.last) / widest).ceil() as usize
        } else {
            self.count
        }
    }

    /// Parses a range of numbers greater than 0, in any of its written forms.
    pub fn positive(text: &str) -> Result<Self, String> {
        let range: Self = text.parse()?;
        if range.first > 0.0 && range.last > 0.0 {
            Ok(range)
        } else {
            Err(format!(
                "`{text}` is not possible: all values must be greater than 0"
            ))
        }
    }
}

impl Range {
    /// Parses a range of numbers of 0 or more, not all 0, in any of its written forms.
    pub fn non_negative(text: &str) -> Result<Self, String> {
        let range: Self = text.parse()?;
        if range.first >= 0.0 && range.last >= 0.0 && range.first.max(range.last) > 0.0 {
            Ok(range)
        } else {
            Err(format!(
                "`{text}` is not possible: no value may be below 0, and one must be greater than 0"
            ))
        }
    }
}

/// Form of a range, for messages.
const FORM: &str = "first:last or first:last:count, such as 600:2400 or 600:2400:91";

/// Numbers of a range as it is written: first, last and count, the latter two `None` where they are missing. Commas in
/// place of colons are read too.
fn parts(text: &str) -> Result<(f64, Option<f64>, Option<usize>), String> {
    let separator = if text.contains(':') { ':' } else { ',' };
    let parts: Vec<&str> = text.split(separator).map(str::trim).collect();
    let number = |part: &str| {
        finite(part).map_err(|_| {
            let meant = meant(text).map_or_else(String::new, |meant| format!("; write {meant}"));
            format!("`{text}` is not a number and not of the form {FORM}{meant}")
        })
    };
    match parts[..] {
        [one] => Ok((number(one)?, None, None)),
        [first, last] => Ok((number(first)?, Some(number(last)?), None)),
        [first, last, count] => {
            let (first, last) = (number(first)?, number(last)?);
            let count = count
                .parse()
                .ok()
                .filter(|count| (1..=Range::MAX_COUNT).contains(count))
                .ok_or_else(|| {
                    format!(
                        "`{text}`: the count `{count}` is not a whole number from 1 to {}; {FORM}",
                        Range::MAX_COUNT
                    )
                })?;
            Ok((first, Some(last), Some(count)))
        }
        _ => Err(format!("`{text}` is not of the form {FORM}")),
    }
}

/// The range that was probably meant by a text such as `600-2400`, `600..2400` or `600 2400`; `None` if the text
/// suggests none.
fn meant(text: &str) -> Option<String> {
    ["..", "-", " ", ";", "/"].into_iter().find_map(|separator| {
        let ends: Vec<&str> = text
            .split(separator)
            .map(str::trim)
            .filter(|end| !end.is_empty())
            .collect();
        let are_numbers = ends.iter().all(|end| finite(end).is_ok());
        (matches!(ends.len(), 2 | 3) && are_numbers).then(|| ends.join(":"))
    })
}

/// Parses both ends of a band, `first:last` in ascending order; `first,last` is read too.
pub(super) fn ends(text: &str) -> Result<[f64; 2], String> {
    ends_such_as(text, "10:30")
}

/// As [`ends`], with an example of what is asked for, which stands in the errors.
fn ends_such_as(text: &str, example: &str) -> Result<[f64; 2], String> {
    let example = format!("two numbers first:last in ascending order are needed, such as {example}");
    match parts(text).map_err(|_| {
        let meant = meant(text).map_or_else(String::new, |meant| format!("; write {meant}"));
        format!("`{text}`: {example}{meant}")
    })? {
        (first, Some(last), None) if first < last => Ok([first, last]),
        (_, _, Some(_)) => Err(format!("`{text}`: a band has no count; {example}")),
        _ => Err(format!("`{text}`: {example}")),
    }
}

/// Parses both ends of a band of numbers of 0 or more.
pub(super) fn non_negative_ends(text: &str) -> Result<[f64; 2], String> {
    not_below_zero(text, ends(text)?)
}

/// Parses the lowest and the highest of a range of spindle speeds in rev/min.
pub(super) fn lowest_and_highest_rpm(text: &str) -> Result<[f64; 2], String> {
    not_below_zero(text, ends_such_as(text, "600:12000")?)
}

fn not_below_zero(text: &str, [first, last]: [f64; 2]) -> Result<[f64; 2], String> {
    if first >= 0.0 {
        Ok([first, last])
    } else {
        Err(format!("`{text}` is not possible: no value may be below 0"))
    }
}

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last, count) = parts(text)?;
        let last = last.unwrap_or(first);
        let count = count.unwrap_or(if first == last { 1 } else { Self::DEFAULT_COUNT });
        if (count == 1) != (first == last) {
            return Err(format!(
                "`{text}`: {count} value(s) cannot go from {first} to {last}; first:last:count, such as 600:2400:91"
            ));
        }
        Ok(Self { first, last, count })
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}:{}", self.first, self.last, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_are_exact() {
        let range: Range = "0.1:0.7:7".parse().unwrap();
        let values = range.values();
        assert_eq!((values[0], values[6], values.len()), (0.1, 0.7, 7));
        // Rounding error: half an ulp of 0.4 for each of two products and one sum.
        assert!((values[3] - 0.4).abs() < 2e-16);
        assert_eq!("900".parse::<Range>().unwrap().values(), [900.0]);
        assert_eq!(
            "2400:600:3".parse::<Range>().unwrap().values(),
            [2400.0, 1500.0, 600.0]
        );
    }

    #[test]
    fn invalid_ranges_are_refused() {
        for text in [
            "", "1:2:0", "1:2:-3", "1:2:1", "1:1:2", "a:2:3", "1:2:3:4", "1:2:2.5",
        ] {
            assert!(text.parse::<Range>().is_err(), "{text}");
        }
        assert!(Range::positive("0:2:3").is_err());
        assert!(Range::positive("1:2:3").is_ok());
    }

    #[test]
    fn one_form_serves_ranges_and_bands() {
        let range = |text: &str| {
            text.parse::<Range>()
                .map(|range| (range.first, range.last, range.count))
        };
        assert_eq!(range("10:30"), Ok((10.0, 30.0, Range::DEFAULT_COUNT)));
        assert_eq!(range("10,30,5"), range("10:30:5"));
        assert_eq!(
            (ends("10:30"), ends("10,30")),
            (Ok([10.0, 30.0]), Ok([10.0, 30.0]))
        );
        for (text, words) in [
            ("700-2000", "write 700:2000"),
            ("700..2000", "write 700:2000"),
            ("fast", "not a number"),
            ("10:30:5:1", "first:last:count"),
        ] {
            let said = range(text).unwrap_err();
            assert!(said.contains(words) && said.contains("600:2400:91"), "{said}");
        }
        for text in ["10", "30:10", "10:30:5", "10:10", "low:high"] {
            assert!(ends(text).unwrap_err().contains("10:30"), "{text}");
        }
        assert!(ends("10-30").unwrap_err().contains("write 10:30"));
        assert!(non_negative_ends("-1:3").is_err());
    }
}
