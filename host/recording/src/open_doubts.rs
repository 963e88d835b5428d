//! Columns of a recorded file whose meaning is in doubt, and the channel names and units that are proposed for them.

use super::Quantity;
use super::doubt::Doubt;
use super::meaning::Meaning;
use super::raw::RawColumn;
use super::understood::Basis;

/// First letter of the standard names of channels of a quantity: `f` force, `v` velocity, `a` acceleration, none for
/// displacement and all other quantities.
pub(super) fn prefix(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Force => "f",
        Quantity::Velocity => "v",
        Quantity::Acceleration => "a",
        _ => "",
    }
}

/// A column of a recorded file whose channel is in doubt: the file does not state its direction, sign, unit or
/// sensitivity, or another column is the same channel.
pub(super) struct Open {
    pub(super) column: String,
    pub(super) quantity: Quantity,
    pub(super) axis: Option<char>,
    pub(super) is_negative: bool,
    /// Quantity of the stated unit; unknown if none is stated.
    pub(super) stated: Quantity,
    /// True if an earlier column already is the channel that the words of this column name.
    pub(super) is_twice: bool,
}

/// Columns that are in doubt.
#[derive(Default)]
pub(super) struct Doubts {
    pub(super) open: Vec<Open>,
}

impl Doubts {
    /// Adds each column, not yet in doubt, whose words name a channel that an earlier column already is; time is no
    /// such channel.
    pub(super) fn twice(&mut self, columns: &[RawColumn], meanings: &[Meaning]) {
        for (index, meaning) in meanings.iter().enumerate() {
            let is_open = self.open.iter().any(|open| open.column == columns[index].name);
            let is_twice = meanings[..index].iter().any(|other| other.name == meaning.name);
            if meaning.from == Basis::Words && is_twice && !is_open && meaning.name != "t" {
                self.open.push(Open {
                    column: columns[index].name.clone(),
                    quantity: meaning.quantity,
                    axis: meaning.name.chars().last().filter(|last| "xyz".contains(*last)),
                    is_negative: false,
                    stated: meaning.quantity,
                    is_twice: true,
                });
            }
        }
    }

    /// The columns in doubt, each with a proposed channel name and, where the file states none, a proposed unit or
    /// sensitivity; each name is proposed only once.
    pub(super) fn suggested(&self, meanings: &[Meaning]) -> Vec<Doubt> {
        let mut taken: Vec<String> = meanings.iter().map(|meaning| meaning.name.clone()).collect();
        let mut doubts = Vec::new();
        for open in &self.open {
            let prefix = prefix(open.quantity);
            let axes = open.axis.map_or_else(|| vec!['x', 'y', 'z'], |axis| vec![axis]);
            let free = axes
                .iter()
                .map(|axis| format!("{prefix}{axis}"))
                .find(|name| !taken.contains(name));
            let name = free.unwrap_or_else(|| {
                let first = format!("{prefix}{}", axes[0]);
                (2..)
                    .map(|number| format!("{first}_{number}"))
                    .find(|name| !taken.contains(name))
                    .unwrap_or(first)
            });
            taken.push(name.clone());
            let has_unit = open.stated == open.quantity;
            let sensitivity = (open.stated == Quantity::Voltage).then_some(match open.quantity {
                Quantity::Force => "2.2 mV/N",
                Quantity::Acceleration => "10 mV/g",
                Quantity::Velocity => "1 V/(m/s)",
                _ => "1 V/mm",
            });
            doubts.push(Doubt {
                what: open.what(),
                column: open.column.clone(),
                name: if open.is_negative {
                    format!("-{name}")
                } else {
                    name
                },
                unit: (!has_unit && sensitivity.is_none()).then(|| open.quantity.unit()),
                sensitivity,
            });
        }
        doubts
    }
}

impl Open {
    /// Sentence part about a column in doubt: what it measures, and what the file does not state about it.
    fn what(&self) -> String {
        let mut lacks = Vec::new();
        if self.is_twice {
            lacks.push("which of several sensors of this direction it is");
        }
        if self.axis.is_none() {
            lacks.push("its direction");
        }
        if self.is_negative {
            lacks.push("whether its sign is already turned");
        }
        match self.stated {
            Quantity::Voltage if self.quantity != Quantity::Voltage => lacks.push("its sensitivity"),
            stated if stated != self.quantity => lacks.push("its unit"),
            _ => {}
        }
        let article = if self.quantity == Quantity::Acceleration {
            "an"
        } else {
            "a"
        };
        format!(
            "column \"{}\" is {article} {}, but the file does not state {}",
            self.column,
            self.quantity,
            lacks.join(" and ")
        )
    }
}
