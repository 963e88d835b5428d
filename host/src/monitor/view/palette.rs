//! Styles of the view. A colour never says anything that no letter says too.

use quietcut_core::detector::Verdict;
use ratatui::style::{Color, Modifier, Style};

/// Styles, with or without colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Palette {
    has_colours: bool,
}

impl Palette {
    /// With colours, unless the environment forbids them: `NO_COLOR` is set and not empty (no-color.org).
    pub(crate) fn of_environment() -> Self {
        Self {
            has_colours: std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
        }
    }

    /// Without colours.
    #[cfg(test)]
    pub(crate) const PLAIN: Self = Self { has_colours: false };

    fn colour(self, colour: Color) -> Style {
        if self.has_colours {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    /// Style of a verdict; `None` is that of a device that is gone.
    pub(super) fn verdict(self, verdict: Option<Verdict>) -> Style {
        self.colour(match verdict {
            Some(Verdict::Hopf | Verdict::PeriodDoubling) => Color::LightRed,
            Some(Verdict::Forced | Verdict::Runout) => Color::LightYellow,
            Some(Verdict::Stable) => Color::LightGreen,
            Some(Verdict::AirCut) => Color::LightBlue,
            Some(Verdict::Indeterminate) | None => Color::Gray,
        })
    }

    /// Style of curves, bars and points.
    pub(super) fn curve(self) -> Style {
        self.colour(Color::LightCyan)
    }

    /// Style of marks of the chatter frequency and of the working point.
    pub(super) fn mark(self) -> Style {
        self.colour(Color::LightRed).add_modifier(Modifier::BOLD)
    }

    /// Style of axes, frames and key names.
    pub(super) fn faint(self) -> Style {
        self.colour(Color::Gray)
    }

    /// Style of titles.
    pub(super) fn title(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }
}
