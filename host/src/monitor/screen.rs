//! The loop over news, keys and pictures.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use quietcut_core::lobes::TableError;
use quietcut_core::protocol::Info;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, KeyCode, KeyEventKind, KeyModifiers};

use super::choices::Choices;
use super::link::{self, News};
use super::lobes::LobeMap;
use super::received::Received;
use super::view::{self, palette::Palette};
use crate::device::{Client, DeviceError};
use crate::report::answer::VerdictLog;

/// Shortest time between two pictures: a choice; ten a second are smooth, and little over a slow line.
const BETWEEN_PICTURES: Duration = Duration::from_millis(100);

/// Longest wait for a key before news are taken: a choice well below the time between two pictures.
const KEY_TIMEOUT: Duration = Duration::from_millis(30);

/// Number of news that wait for the view: a choice above the events of a second. The thread of the device waits when it
/// is full.
const WAITING_NEWS: usize = 4096;

/// Longest wait for the device after the view was closed: a choice above the time of one request that succeeds.
const GOODBYE: Duration = Duration::from_millis(1500);

/// End of the view that is no choice of the user.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ScreenError {
    /// The terminal cannot be used.
    #[error("the terminal cannot be drawn on: {0}; use --lines")]
    Terminal(#[from] io::Error),
    /// The device cannot be reached.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The lobe table is invalid.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The thread of the device ended without news.
    #[error("the thread that listens to the device has ended; please report it")]
    Silent,
}

/// Outcome of a view that the user has closed.
pub(crate) struct Outcome {
    /// Changes of verdict and advice, and the summary.
    pub(crate) log: VerdictLog,
    /// Number of messages lost on the serial line of the last connection.
    pub(crate) lost_frames: u32,
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
    let mut received = Received::new(port);
    received.lobes = table.map(|bytes| LobeMap::new(bytes, None)).transpose()?;
    let mut terminal = ratatui::try_init()?;
    let (send, news) = sync_channel(WAITING_NEWS);
    let over = stop.clone();
    std::thread::spawn(move || link::listen(connect, &send, &over));
    let mut screen = Screen {
        received,
        frozen: None,
        choices: Choices::default(),
        palette: Palette::of_environment(),
    };
    let outcome = screen.run(&mut terminal, &news, stop);
    stop.store(true, Ordering::Relaxed);
    // A terminal that cannot be restored is closed: nobody reads the message.
    let _ = ratatui::try_restore();
    outcome?;
    Ok(Outcome {
        log: screen.received.log,
        lost_frames: goodbye(&news),
    })
}

/// Waits until the thread of the device has ended its subscription, for [`GOODBYE`] at most; returns the number of lost
/// messages.
fn goodbye(news: &Receiver<News>) -> u32 {
    let began = Instant::now();
    while let Some(left) = GOODBYE.checked_sub(began.elapsed()) {
        match news.recv_timeout(left) {
            Ok(News::Ended(lost)) => return lost,
            Ok(_) => {}
            Err(_) => break,
        }
    }
    0
}

/// State of the view.
struct Screen {
    received: Received,
    /// Copy that is shown while the picture stands still.
    frozen: Option<Box<Received>>,
    choices: Choices,
    palette: Palette,
}

impl Screen {
    fn run(
        &mut self,
        terminal: &mut DefaultTerminal,
        news: &Receiver<News>,
        stop: &AtomicBool,
    ) -> Result<(), ScreenError> {
        self.draw(terminal)?;
        let mut drawn = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if event::poll(KEY_TIMEOUT)? && !self.take_input(terminal)? {
                return Ok(());
            }
            self.take_news(news)?;
            if drawn.elapsed() >= BETWEEN_PICTURES {
                self.draw(terminal)?;
                drawn = Instant::now();
            }
        }
        Ok(())
    }

    fn draw(&self, terminal: &mut DefaultTerminal) -> io::Result<()> {
        let shown = self.frozen.as_deref().unwrap_or(&self.received);
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
                    None => Some(Box::new(self.received.clone())),
                }
            }
            KeyCode::Char('c') => self.received.clear_map(),
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

    /// Takes all news that wait.
    fn take_news(&mut self, news: &Receiver<News>) -> Result<(), ScreenError> {
        loop {
            match news.try_recv() {
                Ok(News::Up(identity)) => {
                    let point = identity.working_point;
                    self.received.lobes = self
                        .received
                        .lobes
                        .take()
                        .map(|lobes| lobes.at(point))
                        .transpose()?;
                    self.received.connected(identity);
                }
                Ok(News::Event(event)) => self.received.take(&event),
                Ok(News::Gone(error)) => self.received.gone(error.to_string()),
                Ok(News::Failed(error)) => return Err(error.into()),
                Ok(News::Ended(_)) => return Ok(()),
                Err(TryRecvError::Empty) => return Ok(()),
                Err(TryRecvError::Disconnected) => return Err(ScreenError::Silent),
            }
        }
    }
}
