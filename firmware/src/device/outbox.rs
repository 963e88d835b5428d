//! Messages that wait for room in the output queue of the link.

use heapless::Vec;
use quietcut_core::monitor::{Band, Report, State};
use quietcut_core::protocol::{Reply, Response, SpectrumChunk, StrobeChunk, Subscription};

use crate::link::Link;

const BANDS: [Band; 2] = [Band::Structure, Band::Tool];

/// Messages that wait for room in the output queue to the host: a report, points of the stroboscopic map and spectra,
/// in this order, and a reply before or after all of them.
///
/// Points and spectra stay in the state of the signal chain. Only the progress of their transmission is stored here.
#[derive(Default)]
pub(super) struct Outbox {
    report: Option<Report>,
    strobes: Option<Strobes>,
    spectra: [Option<Spectrum>; BANDS.len()],
    /// The reply that waits to be sent, with the sequence number of its request; `None` if no reply waits.
    reply: Option<(u16, Reply)>,
    /// True if the reply follows all messages that the request caused, false if it precedes them.
    is_reply_last: bool,
    dropped: u32,
}

/// Progress of sending the points of the stroboscopic map of one block.
struct Strobes {
    sequence: u32,
    next: usize,
}

/// Progress of sending one power spectrum.
struct Spectrum {
    /// Sequence number of the block of samples that completed the spectrum.
    sequence: u32,
    /// Index of the first bin of the spectrum that is not yet sent.
    next: usize,
}

impl Outbox {
    /// Number of reports, sets of stroboscopic points and spectra that were dropped before they were completely sent.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    /// True while a reply waits to be sent. Until it is sent, no further request is received.
    pub(super) fn has_reply(&self) -> bool {
        self.reply.is_some()
    }

    /// Discards all messages that wait to be sent, after the state of the signal chain was reset.
    pub(super) fn clear(&mut self) {
        *self = Self {
            dropped: self.dropped,
            ..Self::default()
        };
    }

    /// Drops the reports and stroboscopic points that wait to be sent, because the next step of the signal chain
    /// overwrites them. Spectra stay, because the next step may leave them unchanged.
    pub(super) fn drop_overwritten(&mut self) {
        self.dropped = self
            .dropped
            .saturating_add(u32::from(self.report.take().is_some()))
            .saturating_add(u32::from(self.strobes.take().is_some()));
    }

    /// Queues those results of a step of the signal chain to which the host subscribes.
    pub(super) fn fill(
        &mut self,
        report: Option<Report>,
        sequence: u32,
        state: &State,
        subscription: Subscription,
    ) {
        self.report = report;
        if subscription.strobes && !state.strobes().is_empty() {
            self.strobes = Some(Strobes { sequence, next: 0 });
        }
        for (band, sending) in BANDS.into_iter().zip(&mut self.spectra) {
            if state.has_fresh_spectrum(band) {
                // The new spectrum has overwritten an older one that was not completely sent, which therefore counts as
                // dropped.
                self.dropped = self.dropped.saturating_add(u32::from(sending.is_some()));
                *sending = subscription.spectra.then_some(Spectrum { sequence, next: 0 });
            }
        }
    }

    /// Queues the reply to a request before all other messages.
    pub(super) fn reply(&mut self, request: u16, reply: Reply) {
        self.reply = Some((request, reply));
        self.is_reply_last = false;
    }

    /// Queues the reply to a request after all messages that the request caused.
    pub(super) fn reply_last(&mut self, request: u16, reply: Reply) {
        self.reply = Some((request, reply));
        self.is_reply_last = true;
    }

    /// Sends as many waiting messages as the output queue of the link has room for. Returns the reply if it was sent.
    pub(super) fn pump(&mut self, link: &mut Link, state: &State) -> Option<(u16, Reply)> {
        let mut sent = None;
        while link.room() > 0 {
            if !self.is_reply_last && self.reply.is_some() {
                sent = self.send_reply(link);
            } else if let Some(report) = self.report.take() {
                link.send(&Response::Report(report));
            } else if let Some(strobes) = self.strobes.take() {
                self.strobes = send_strobes(link, state, strobes);
            } else if let Some((band, slot, spectrum)) = self.next_spectrum() {
                *slot = send_spectrum(link, state, band, spectrum);
            } else if self.reply.is_some() {
                sent = self.send_reply(link);
            } else {
                break;
            }
        }
        sent
    }

    fn send_reply(&mut self, link: &mut Link) -> Option<(u16, Reply)> {
        let (request, reply) = self.reply.take()?;
        link.send(&Response::Reply {
            request,
            reply: reply.clone(),
        });
        Some((request, reply))
    }

    /// The next spectrum to send: its band, the field that stores its progress for the next call, and its progress,
    /// which is taken from the field. `None` if no spectrum waits.
    fn next_spectrum(&mut self) -> Option<(Band, &mut Option<Spectrum>, Spectrum)> {
        BANDS.into_iter().zip(&mut self.spectra).find_map(|(band, slot)| {
            let spectrum = slot.take()?;
            Some((band, slot, spectrum))
        })
    }
}

/// Sends the next points of the stroboscopic map. Returns the progress if some points are not yet sent.
fn send_strobes(link: &mut Link, state: &State, strobes: Strobes) -> Option<Strobes> {
    let rest = state.strobes().get(strobes.next..).unwrap_or_default();
    let mut chunk = StrobeChunk {
        sequence: strobes.sequence,
        strobes: Vec::new(),
    };
    chunk
        .strobes
        .extend(rest.iter().copied().take(chunk.strobes.capacity()));
    let next = strobes.next + chunk.strobes.len();
    if !chunk.strobes.is_empty() {
        link.send(&Response::Strobes(chunk));
    }
    (next < state.strobes().len()).then_some(Strobes { next, ..strobes })
}

/// Sends the next chunk of a spectrum. Returns the progress if some bins are not yet sent.
fn send_spectrum(link: &mut Link, state: &State, band: Band, sending: Spectrum) -> Option<Spectrum> {
    let spectrum = state.spectrum(band)?;
    let mut power = Vec::new();
    let rest = spectrum.power.get(sending.next..)?;
    power.extend(rest.iter().copied().take(power.capacity()));
    let next = sending.next + power.len();
    link.send(&Response::Spectrum(SpectrumChunk {
        band,
        sequence: sending.sequence,
        bin: spectrum.bin,
        bins: spectrum.power.len() as u16,
        first: sending.next as u16,
        power,
    }));
    (next < spectrum.power.len()).then_some(Spectrum { next, ..sending })
}
