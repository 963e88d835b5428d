//! The view that the user has chosen by keys.

use quietcut_core::monitor::Band;

/// Chart that a small terminal shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Chart {
    #[default]
    Spectrum,
    Map,
    Lobes,
    History,
}

impl Chart {
    fn next(self) -> Self {
        match self {
            Self::Spectrum => Self::Map,
            Self::Map => Self::Lobes,
            Self::Lobes => Self::History,
            Self::History => Self::Spectrum,
        }
    }
}

/// Largest number of doublings of the frequency scale: a choice; 32 times finer shows a few bins.
const FINEST_ZOOM: u8 = 5;

/// Names of the axes of the sensor.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];

/// The chosen view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Choices {
    /// Band of spectrum and stroboscopic map.
    pub(crate) band: Band,
    /// Axes of the stroboscopic map: indices of the horizontal and of the vertical one.
    pub(crate) axes: (usize, usize),
    /// The frequency scale ends at the band divided by 2 to this power; `None` fits it to speed and chatter.
    pub(crate) zoom: Option<u8>,
    /// Chart of a terminal without room for all.
    pub(crate) chart: Chart,
}

impl Default for Choices {
    fn default() -> Self {
        Self {
            band: Band::Structure,
            axes: (0, 1),
            zoom: None,
            chart: Chart::default(),
        }
    }
}

impl Choices {
    /// Changes the choice to which the key belongs; false if it belongs to none.
    pub(crate) fn take(&mut self, key: char) -> bool {
        match key {
            'b' => {
                self.band = match self.band {
                    Band::Structure => Band::Tool,
                    Band::Tool => Band::Structure,
                }
            }
            'a' => {
                self.axes = match self.axes {
                    (0, 1) => (0, 2),
                    (0, 2) => (1, 2),
                    _ => (0, 1),
                }
            }
            '+' | '=' => self.zoom = Some(self.zoom.map_or(1, |zoom| (zoom + 1).min(FINEST_ZOOM))),
            '-' => self.zoom = Some(self.zoom.unwrap_or(0).saturating_sub(1)),
            '0' => self.zoom = None,
            '\t' => self.chart = self.chart.next(),
            _ => return false,
        }
        true
    }
}
