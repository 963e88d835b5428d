//! Comparison of two answers to one question, number by number.

use crate::json::Json;
use crate::uncompared;

/// Rule of the comparison of two answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// Every number must be the same to the bit: for two builds on one machine.
    Bits,
    /// Numbers must agree within the tolerance; names, verdicts, kinds and counts must be equal.
    Tolerance,
}

/// Tolerance of a number as a share of its stated half-width.
///
/// A change within it is far smaller than the stated uncertainty of the number.
const OF_HALF_WIDTH: f64 = 1e-6;

/// Tolerance of a number relative to the larger of itself and the largest number of its array.
///
/// Sums of 10⁶ terms in double precision are accurate to 10⁶ · 2⁻⁵³ ≈ 1e-10; a changed formula is worse than 1e-9.
const RELATIVE: f64 = 1e-9;

/// A value in which two answers differ.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Difference {
    /// Path of the value in the answer.
    pub(crate) path: String,
    /// The value of the reference.
    pub(crate) before: String,
    /// The value of this build.
    pub(crate) now: String,
}

/// All differences between the reference's answer and the answer of this build.
pub(crate) fn differences(before: &Json, now: &Json, rule: Rule) -> Vec<Difference> {
    let command = now.get("command").and_then(Json::text).unwrap_or_default();
    let mut comparison = Comparison {
        verb: command.split_whitespace().next().unwrap_or_default(),
        rule,
        found: Vec::new(),
    };
    comparison.value("", before, now, Scale::default());
    comparison.found
}

/// The quantities from which the tolerance of a number follows.
#[derive(Debug, Clone, Copy, Default)]
struct Scale {
    half_width: Option<f64>,
    largest: f64,
}

struct Comparison<'a> {
    verb: &'a str,
    rule: Rule,
    found: Vec<Difference>,
}

impl Comparison<'_> {
    fn differ(&mut self, path: &str, before: Option<&Json>, now: Option<&Json>) {
        let short = |value: Option<&Json>| {
            value.map_or("(missing)".to_owned(), |v| v.write().chars().take(120).collect())
        };
        self.found.push(Difference {
            path: path.to_owned(),
            before: short(before),
            now: short(now),
        });
    }

    fn value(&mut self, path: &str, before: &Json, now: &Json, scale: Scale) {
        match (before, now) {
            (Json::Map(a), Json::Map(b)) => self.map(path, (before, a), (now, b)),
            (Json::List(a), Json::List(b)) => {
                if a.len() != b.len() {
                    self.differ(&format!("{path}.length"), Some(before), Some(now));
                    return;
                }
                let largest = scale.largest.max(before.largest());
                for (i, (x, y)) in a.iter().zip(b).enumerate() {
                    self.value(&format!("{path}[{i}]"), x, y, Scale { largest, ..scale });
                }
            }
            (Json::Number(a), Json::Number(b)) => {
                if !self.same_number(a, b, scale) {
                    self.differ(path, Some(before), Some(now));
                }
            }
            _ => {
                if before != now {
                    self.differ(path, Some(before), Some(now));
                }
            }
        }
    }

    fn map(&mut self, path: &str, before: (&Json, &[(String, Json)]), now: (&Json, &[(String, Json)])) {
        for (key, value) in before.1 {
            if uncompared::is_uncompared(self.verb, key, self.rule) {
                continue;
            }
            let path = format!("{path}.{key}");
            match now.0.get(key) {
                Some(other) => self.value(&path, value, other, scale_of(key, before)),
                None => self.differ(&path, Some(value), None),
            }
        }
        for (key, value) in now.1 {
            if before.0.get(key).is_none() && !uncompared::is_uncompared(self.verb, key, self.rule) {
                self.differ(&format!("{path}.{key}"), None, Some(value));
            }
        }
    }

    fn same_number(&self, a: &str, b: &str, scale: Scale) -> bool {
        if a == b {
            return true;
        }
        let (Ok(x), Ok(y)) = (a.parse::<f64>(), b.parse::<f64>()) else {
            return false;
        };
        let counts = |text: &str| !text.contains(['.', 'e', 'E']);
        if self.rule == Rule::Bits || (counts(a) && counts(b)) {
            return x.to_bits() == y.to_bits();
        }
        let relative = RELATIVE * x.abs().max(y.abs()).max(scale.largest);
        let of_half_width = scale.half_width.map_or(0.0, |half| OF_HALF_WIDTH * half);
        (x - y).abs() <= relative.max(of_half_width)
    }
}

/// The half-width that a map states for one of its keys, and for an error the magnitude of the number that has this error.
fn scale_of(key: &str, (map, entries): (&Json, &[(String, Json)])) -> Scale {
    let mut scale = Scale::default();
    if let Some(Json::List(ends)) = map.get("ci90")
        && let [low, high] = ends.as_slice()
        && let (Some(low), Some(high)) = (low.number(), high.number())
        && (key == "value" || key == "ci90")
    {
        scale.half_width = Some((high - low).abs() / 2.0);
    }
    let is_error = key == "error" || key == "error_mm";
    let stated = if key.ends_with("_mm") { "error_mm" } else { "error" };
    if is_error {
        // An error is computed from differences of the other numbers of its map, so that it is as accurate as those.
        let of_siblings = |(k, v): &(String, Json)| match (key, k.as_str()) {
            ("error_mm", k) if k.ends_with("_mm") => v.largest(),
            ("error", "value" | "multiplier" | "multiplier_abs") => v.largest(),
            _ => 0.0,
        };
        scale.largest = entries.iter().map(of_siblings).fold(0.0, f64::max);
    } else if let Some(error) = map.get(stated).and_then(Json::number) {
        scale.half_width = Some(error.abs());
    }
    scale
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const ANSWER: &str = r#"{"verdict":"stable","count":3,"warnings":["one"],"why":"because",
        "limit":{"value":2.0,"ci90":[1.0,3.0]},"hz":17.5,"spectrum":[1000.0,1e-12]}"#;

    /// Number of differences after `from` was replaced by `to`.
    fn changed(from: &str, to: &str, rule: Rule) -> usize {
        assert!(ANSWER.contains(from));
        let read = |text: &str| Json::read(text).unwrap();
        differences(&read(ANSWER), &read(&ANSWER.replace(from, to)), rule).len()
    }

    #[test]
    fn a_change_is_found_by_the_rule_that_forbids_it() {
        // Rows: value before, value after, differences by the rule of bits, differences by the rule of tolerance.
        for (from, to, bits, tolerance) in [
            ("17.5", "17.5", 0, 0),
            ("17.5", "17.500000000000004", 1, 0),
            ("17.5", "17.5000001", 1, 1),
            ("17.5", "17.50000001", 1, 0),
            ("17.5", "null", 1, 1),
            ("\"value\":2.0", "\"value\":2.0000009", 1, 0),
            ("\"value\":2.0", "\"value\":2.000002", 1, 1),
            ("stable", "chatter", 1, 1),
            ("\"count\":3", "\"count\":4", 1, 1),
            ("\"hz\":17.5,", "", 1, 1),
            ("\"hz\"", "\"rpm\"", 2, 2),
            ("[1000.0,1e-12]", "[1000.0,2e-12]", 1, 0),
            ("[1000.0,1e-12]", "[1000.0,1e-5]", 1, 1),
            ("[1000.0,1e-12]", "[1000.0]", 1, 1),
            ("because", "since", 0, 0),
            ("[\"one\"]", "[\"one\",\"two\"]", 0, 0),
        ] {
            assert_eq!(changed(from, to, Rule::Bits), bits, "bits: {from} → {to}");
            assert_eq!(
                changed(from, to, Rule::Tolerance),
                tolerance,
                "tolerance: {from} → {to}"
            );
        }
    }

    #[test]
    fn every_number_of_an_answer_is_compared() {
        for i in 0..1000_u32 {
            let value = f64::from(i).mul_add(0.37, 1.0);
            let text = |x: f64| Json::read(&format!(r#"{{"a":[{{"b":{x:?}}}]}}"#)).unwrap();
            let next = f64::from_bits(value.to_bits() + 1);
            let far = value * (1.0 + 3e-9);
            assert_eq!(differences(&text(value), &text(next), Rule::Bits).len(), 1);
            assert_eq!(differences(&text(value), &text(next), Rule::Tolerance).len(), 0);
            assert_eq!(differences(&text(value), &text(far), Rule::Tolerance).len(), 1);
        }
    }

    #[test]
    fn times_of_one_verb_are_compared_in_the_answers_of_others() {
        for (verb, found) in [("demo", 0), ("simulate", 1)] {
            let text = |seconds: u32| {
                Json::read(&format!(
                    r#"{{"command":"{verb} a","json":[{{"seconds":{seconds}}}]}}"#
                ))
                .unwrap()
            };
            assert_eq!(
                differences(&text(1), &text(2), Rule::Tolerance).len(),
                found,
                "{verb}"
            );
        }
    }

    #[test]
    fn a_value_survives_writing_and_reading() {
        let answer = Json::read(ANSWER).unwrap();
        assert_eq!(Json::read(&answer.write()), Ok(answer));
    }
}
