//! Ranges of evenly spaced values on the command line, written `first:last:count`.

use std::str::FromStr;

use super::number::finite;

/// Evenly spaced values from `first` to `last`, both included; written `first:last:count`, or one number alone.
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

    /// Number of equal steps from 0 to the larger end of the range such that no step is wider than those of the range.
    pub fn steps_from_zero(&self) -> usize {
        let widest = (self.last - self.first).abs() / self.count.max(2) as f64;
        if widest > 0.0 {
            (self.first.max(self.last) / widest).ceil() as usize
        } else {
            self.count
        }
    }

    /// Parses `first:last:count`, a range of numbers greater than 0.
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
    /// Parses `first:last:count`, a range of numbers of 0 or more, not all 0.
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

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        match parts[..] {
            [one] => {
                let value = finite(one).map_err(|_| {
                    format!(
                        "`{text}` is neither a number nor of the form first:last:count, such as 600:2400:91"
                    )
                })?;
                Ok(Self {
                    first: value,
                    last: value,
                    count: 1,
                })
            }
            [first, last, count] => {
                let (first, last) = (finite(first)?, finite(last)?);
                let count = count
                    .parse()
                    .ok()
                    .filter(|count| (1..=Self::MAX_COUNT).contains(count))
                    .ok_or_else(|| {
                        format!(
                            "the count `{count}` is not a whole number from 1 to {}",
                            Self::MAX_COUNT
                        )
                    })?;
                if (count == 1) != (first == last) {
                    return Err(format!(
                        "`{text}`: {count} value(s) cannot go from {first} to {last}; first:last:count, such as 600:2400:91"
                    ));
                }
                Ok(Self { first, last, count })
            }
            _ => Err(format!(
                "`{text}` is not of the form first:last:count, such as 600:2400:91"
            )),
        }
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
            "", "1:2", "1:2:0", "1:2:-3", "1:2:1", "1:1:2", "a:2:3", "1:2:3:4", "1:2:2.5",
        ] {
            assert!(text.parse::<Range>().is_err(), "{text}");
        }
        assert!(Range::positive("0:2:3").is_err());
        assert!(Range::positive("1:2:3").is_ok());
    }
}
