//! What a pipeline says of a cut: on the host, and from a device, in a form that can be compared to the bit.

use std::collections::BTreeMap;
use std::time::Duration;

use quietcut::device::{Client, Event};
use quietcut::simulate::Heard;
use quietcut_core::acceleration::Block;
use quietcut_core::detector::Verdict;
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::{Band, Monitor, Report, Settings, State};
use quietcut_core::protocol::{Reports, Subscription};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;
use quietcut_core::working_point::WorkingPoint;
use quietcut_firmware::stimulus::Stimulus;

/// Everything that can be subscribed to.
pub const ALL: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: true,
};

/// Samples and edges of one step.
pub type Step = (Block, Vec<Edge>);

/// What sensors heard in steps: an edge belongs to the block before whose successor it came.
pub fn steps(heard: Heard) -> Vec<Step> {
    let mut edges = heard.edges.into_iter().peekable();
    let ends: Vec<_> = heard.blocks.iter().skip(1).map(|block| block.time).collect();
    let ends = ends.into_iter().chain([Nanoseconds(u64::MAX)]);
    let steps = heard.blocks.into_iter().zip(ends).map(|(block, end)| {
        let mine = std::iter::from_fn(|| edges.next_if(|edge| edge.time < end));
        let mine = mine.collect();
        (block, mine)
    });
    steps.collect()
}

/// Steps as the virtual spindle of an emulated board sends them.
pub fn stimuli(steps: &[Step]) -> Vec<Stimulus> {
    let of = |(block, edges): &Step| {
        let edges = edges.iter().copied().map(Stimulus::Edge);
        edges.chain([Stimulus::Block(block.clone())]).collect::<Vec<_>>()
    };
    steps.iter().flat_map(of).collect()
}

/// What was said. Numbers are kept by their bits: a NaN equals itself, and 0 is not −0.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Said {
    /// Reports in postcard, in their order.
    pub reports: Vec<Vec<u8>>,
    /// Coordinates of the stroboscopic map, by the block that made them.
    pub strobes: BTreeMap<u32, Vec<u8>>,
    /// Bins of the spectra, by band and by the block that completed them.
    pub spectra: BTreeMap<(bool, u32), Vec<u32>>,
}

fn bytes<T: serde::Serialize>(value: &T) -> Vec<u8> {
    let mut buffer = [0; 512];
    postcard::to_slice(value, &mut buffer)
        .expect("room for a message")
        .to_vec()
}

impl Said {
    /// Runs the host's pipeline over a cut.
    pub fn on_host(
        settings: Settings,
        table: Option<&[u8]>,
        cut: Option<&WorkingPoint>,
        steps: &[Step],
    ) -> Self {
        let monitor = Monitor::new(settings).expect("settings that can be");
        let table = table.map(|bytes| LobeTable::parse(bytes).expect("a table"));
        let mut state = State::default();
        let mut said = Self::default();
        for (block, edges) in steps {
            let report = monitor.step(&mut state, block, edges, table.as_ref(), cut);
            said.reports.push(bytes(&report));
            for strobe in state.strobes() {
                said.strobes
                    .entry(block.sequence)
                    .or_default()
                    .extend(bytes(strobe));
            }
            for band in [Band::Structure, Band::Tool] {
                if state.has_fresh_spectrum(band)
                    && let Some(spectrum) = state.spectrum(band)
                {
                    let bins = spectrum.power.iter().map(|power| power.to_bits()).collect();
                    said.spectra.insert((band == Band::Tool, block.sequence), bins);
                }
            }
        }
        said
    }

    /// Listens to a device until it has said something of as many blocks, and then falls silent.
    pub fn from_device(client: &mut Client, blocks: usize, patience: Duration) -> Self {
        let mut said = Self::default();
        let quiet = Duration::from_millis(200);
        loop {
            let wait = if said.reports.len() < blocks {
                patience
            } else {
                quiet
            };
            let event = client.next_event(wait).expect("the line holds");
            match event {
                Some(Event::Report(report)) => said.reports.push(bytes(&report)),
                Some(Event::Strobes(chunk)) => {
                    let strobes = said.strobes.entry(chunk.sequence).or_default();
                    for strobe in &chunk.strobes {
                        strobes.extend(bytes(strobe));
                    }
                }
                Some(Event::Spectrum(chunk)) => {
                    let key = (chunk.band == Band::Tool, chunk.sequence);
                    let bins = said.spectra.entry(key).or_default();
                    assert_eq!(
                        bins.len(),
                        usize::from(chunk.first),
                        "pieces of a spectrum in their order"
                    );
                    bins.extend(chunk.power.iter().map(|power| power.to_bits()));
                }
                None => {
                    let reports = said.reports.len();
                    assert!(
                        reports >= blocks,
                        "only {reports} reports of {blocks} blocks within {patience:?}"
                    );
                    return said;
                }
            }
        }
    }

    /// Asserts that a device said the same; names the first report that differs in words.
    pub fn assert_same(&self, device: &Self) {
        self.assert_same_reports(device);
        assert!(
            self.strobes == device.strobes,
            "points of the stroboscopic map differ"
        );
        let which = |said: &Self| said.spectra.keys().copied().collect::<Vec<_>>();
        assert_eq!(which(self), which(device), "blocks with spectra");
        assert!(self.spectra == device.spectra, "bins of the spectra differ");
    }

    /// The same of the reports alone.
    pub fn assert_same_reports(&self, device: &Self) {
        let pairs = self.reports.iter().zip(&device.reports);
        for (number, (here, there)) in pairs.enumerate() {
            let words = |bytes| postcard::from_bytes::<Report>(bytes).expect("a report");
            assert!(
                here == there,
                "report {number}: host {:?}, device {:?}",
                words(here),
                words(there)
            );
        }
        assert_eq!(self.reports.len(), device.reports.len(), "number of reports");
    }

    /// The first chatter that was called.
    pub fn first_alarm(&self) -> Option<Verdict> {
        let verdicts = self.reports.iter().map(|bytes| {
            let report: Report = postcard::from_bytes(bytes).expect("a report");
            report.judgement.verdict
        });
        verdicts.into_iter().find(|verdict| verdict.is_chatter())
    }
}
