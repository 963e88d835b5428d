//! What the pipeline has said and the line has not taken yet.

use heapless::Vec;
use quietcut_core::monitor::{Band, Report, State};
use quietcut_core::protocol::{Reply, Response, SpectrumChunk, StrobeChunk, Subscription};

use crate::link::Link;

const BANDS: [Band; 2] = [Band::Structure, Band::Tool];

/// Reports, points of the stroboscopic map and spectra on their way out, in this order.
///
/// Points and spectra stay in the pipeline's state; what waits here is how much of them was sent.
#[derive(Default)]
pub(super) struct Outbox {
    report: Option<Report>,
    strobes: Option<Strobes>,
    spectra: [Option<Spectrum>; BANDS.len()],
    /// The reply to the request that is being done, with its sequence number.
    reply: Option<(u16, Reply)>,
    /// True where the reply comes behind all that the request has made, false where it goes first.
    is_reply_last: bool,
    dropped: u32,
}

struct Strobes {
    sequence: u32,
    next: usize,
}

/// A spectrum that is being sent.
struct Spectrum {
    /// Sequence number of the block that completed it.
    sequence: u32,
    /// The first bin that was not sent.
    next: usize,
}

impl Outbox {
    /// Messages that were given up because the line is too slow.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    /// True while a reply waits: the next request must too.
    pub(super) fn has_reply(&self) -> bool {
        self.reply.is_some()
    }

    /// Gives up what waits, and takes spectra from now on for new: the state was reset.
    pub(super) fn clear(&mut self) {
        *self = Self {
            dropped: self.dropped,
            ..Self::default()
        };
    }

    /// Gives up what the step before has left, since the state is about to change: spectra that go on are kept, for the
    /// state may not touch them.
    pub(super) fn make_way(&mut self) {
        self.dropped = self
            .dropped
            .saturating_add(u32::from(self.report.take().is_some()))
            .saturating_add(u32::from(self.strobes.take().is_some()));
    }

    /// Takes what a step has made, as far as it is subscribed to.
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
                // One that was not finished is gone: its memory now holds this one.
                self.dropped = self.dropped.saturating_add(u32::from(sending.is_some()));
                *sending = subscription.spectra.then_some(Spectrum { sequence, next: 0 });
            }
        }
    }

    /// Takes the reply to a request: it goes first.
    pub(super) fn reply(&mut self, request: u16, reply: Reply) {
        self.reply = Some((request, reply));
        self.is_reply_last = false;
    }

    /// Takes the reply to a request that has made all that waits: it goes last.
    pub(super) fn reply_last(&mut self, request: u16, reply: Reply) {
        self.reply = Some((request, reply));
        self.is_reply_last = true;
    }

    /// Sends as much as the link has room for; the reply, if that was sent.
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

    /// The band whose spectrum is being sent, where to put what is left of it, and the spectrum.
    fn next_spectrum(&mut self) -> Option<(Band, &mut Option<Spectrum>, Spectrum)> {
        BANDS.into_iter().zip(&mut self.spectra).find_map(|(band, slot)| {
            let spectrum = slot.take()?;
            Some((band, slot, spectrum))
        })
    }
}

/// Sends the next points of the map; what is left of them.
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

/// Sends the next piece of a spectrum; what is left of it.
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
