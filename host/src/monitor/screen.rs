//! The loop over news, keys and pictures.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use quietcut_core::protocol::Info;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, KeyCode, KeyEventKind, KeyModifiers};

use super::choices::Choices;
use super::live::{Live, LiveError, Outcome};
use super::received::Received;
use super::view::{self, palette::Palette};
use crate::device::{Client, DeviceError};
use crate::messages::{self, Hold};

/// Shortest time between two pictures: a choice; ten a second are smooth, and little over a slow line.
const BETWEEN_PICTURES: Duration = Duration::from_millis(100);

/// Longest wait for a key before news are taken: a choice well below the time between two pictures.
const KEY_TIMEOUT: Duration = Duration::from_millis(30);

/// End of the view that is no choice of the user.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ScreenError {
    /// The terminal cannot be used.
    #[error("the terminal cannot be drawn on: {0}; use --lines")]
    Terminal(#[from] io::Error),
    /// The device cannot be reached, or its table cannot be used.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// A thread has panicked; its message is printed.
    #[error("the picture has ended after a fault in quietcut itself")]
    Fault,
}

/// Shows the device at `port` until the user quits or `stop` is true. `connect` makes a connection; `table` holds the
/// bytes of a lobe table for chart and margin.
///
/// # Errors
/// The terminal cannot be used, the first connection fails, or a later one fails for a reason that a plug does not
/// remove. The terminal is as before in every case, a panic included.
pub(crate) fn show(
    port: &str,
    connect: impl FnMut() -> Result<(Client, Info), DeviceError> + Send + 'static,
    table: Option<Vec<u8>>,
    stop: &Arc<AtomicBool>,
) -> Result<Outcome, ScreenError> {
    let live = Live::start(port, connect, table, stop).map_err(LiveError::from)?;
    // Dropped after the terminal is as before, and then prints what was held back.
    let messages = Hold::begin();
    let mut terminal = ratatui::try_init()?;
    let mut screen = Screen {
        live,
        messages,
        frozen: None,
        choices: Choices::default(),
        palette: Palette::of_environment(),
    };
    let outcome = screen.run(&mut terminal, stop);
    // A terminal that cannot be restored is closed: nobody reads the message.
    let _ = ratatui::try_restore();
    outcome.map(|()| screen.live.end())
}

/// State of the view.
struct Screen {
    live: Live,
    messages: Hold,
    /// Copy that is shown while the picture stands still.
    frozen: Option<Box<Received>>,
    choices: Choices,
    palette: Palette,
}

impl Screen {
    fn run(&mut self, terminal: &mut DefaultTerminal, stop: &AtomicBool) -> Result<(), ScreenError> {
        self.draw(terminal)?;
        let mut drawn = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if event::poll(KEY_TIMEOUT)? && !self.take_input(terminal)? {
                return Ok(());
            }
            while self.live.take(Duration::ZERO)? {}
            for line in self.messages.take_lines() {
                self.live.received.line(line);
            }
            if messages::has_fault() {
                return Err(ScreenError::Fault);
            }
            if drawn.elapsed() >= BETWEEN_PICTURES {
                self.draw(terminal)?;
                drawn = Instant::now();
            }
        }
        Ok(())
    }

    fn draw(&self, terminal: &mut DefaultTerminal) -> io::Result<()> {
        let shown = self.frozen.as_deref().unwrap_or(&self.live.received);
        let is_frozen = self.frozen.is_some();
        terminal.draw(|frame| view::draw(frame, shown, &self.choices, self.palette, is_frozen))?;
        Ok(())
    }

    /// Takes one event of the terminal; false if the user quits.
    fn take_input(&mut self, terminal: &mut DefaultTerminal) -> io::Result<bool> {
        let event::Event::Key(key) = event::read()? else {
            // A new size is found by the next picture.
            return Ok(true);
        };
        if key.kind == KeyEventKind::Release {
            return Ok(true);
        }
        match key.code {
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return Ok(false),
            KeyCode::Char('q') | KeyCode::Esc => return Ok(false),
            KeyCode::Char(' ') => {
                self.frozen = match self.frozen {
                    Some(_) => None,
                    None => Some(Box::new(self.live.received.clone())),
                }
            }
            KeyCode::Char('c') => self.live.received.clear_map(),
            KeyCode::Char('r') => terminal.clear()?,
            KeyCode::Tab => {
                self.choices.take('\t');
            }
            KeyCode::Char(key) => {
                self.choices.take(key);
            }
            _ => {}
        }
        Ok(true)
    }
}
