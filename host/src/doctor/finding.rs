//! One finding: what was found, and what to do.

use serde::Serialize;

/// State of the thing that a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// It is as it should be.
    Good,
    /// It works, and could be better.
    Note,
    /// It prevents a measurement, a verdict or a right advice.
    Problem,
}

/// What was found, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// The thing that the finding is about, such as `firmware`.
    pub subject: &'static str,
    /// Its state.
    pub state: State,
    /// What was found, as a sentence without its full stop.
    pub found: String,
    /// What to do, as a sentence without its full stop; `None` if there is nothing to do.
    pub to_do: Option<String>,
}

impl Finding {
    /// A thing that is as it should be.
    pub fn good(subject: &'static str, found: impl Into<String>) -> Self {
        Self {
            subject,
            state: State::Good,
            found: found.into(),
            to_do: None,
        }
    }

    /// A thing that works and could be better.
    pub fn note(subject: &'static str, found: impl Into<String>, to_do: impl Into<String>) -> Self {
        Self {
            subject,
            state: State::Note,
            found: found.into(),
            to_do: Some(to_do.into()),
        }
    }

    /// A thing that must be mended.
    pub fn problem(subject: &'static str, found: impl Into<String>, to_do: impl Into<String>) -> Self {
        Self {
            state: State::Problem,
            ..Self::note(subject, found, to_do)
        }
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mark = match self.state {
            State::Good => "ok     ",
            State::Note => "note   ",
            State::Problem => "PROBLEM",
        };
        write!(f, "{mark}  {:<14}{}", self.subject, self.found)?;
        if let Some(to_do) = &self.to_do {
            write!(f, "\n         {:<14}→ {to_do}", "")?;
        }
        Ok(())
    }
}
