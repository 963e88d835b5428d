//! A device with its line, its host and its clock.

use std::cell::Cell;
use std::rc::Rc;

use crate::support::{Host, SETTINGS, Wire};
use quietcut_core::acceleration::Sensor;
use quietcut_core::lobes::Header;
use quietcut_core::monitor::State;
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{Info, Reply, Reports, Request, Response, Status, Subscription, Upload};
use quietcut_core::units::{Degrees, Millimeters, Nanoseconds};
use quietcut_core::working_point::WorkingPoint;
use quietcut_firmware::device::{Clock, Device, Identity};
use quietcut_firmware::flash_model::FlashModel;

pub(crate) type Flash = FlashModel<Vec<u8>, 8, 2048>;

pub(crate) const IDENTITY: Identity = Identity {
    board: "test",
    sensor: Some(Sensor::IIS3DWB_16G),
};
pub(crate) const ALL: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: true,
};
pub(crate) const POINT: WorkingPoint = WorkingPoint {
    axial_depth: Millimeters(2.0),
    start: Degrees(90.0),
    exit: Degrees(180.0),
    feed_per_tooth: Millimeters(0.15),
    posture: 0,
};

pub(crate) fn flash() -> Flash {
    Flash::new(vec![0xFF; 32 * 2048])
}

/// A clock that a test sets.
#[derive(Clone, Default)]
pub(crate) struct TestClock(pub(crate) Rc<Cell<u64>>);

impl Clock for TestClock {
    fn now(&self) -> Nanoseconds {
        Nanoseconds(self.0.get())
    }
}

/// A device that is connected to a host by a line.
pub(crate) struct Bench<'a> {
    pub(crate) device: Device<'a, Flash, TestClock>,
    pub(crate) clock: TestClock,
    pub(crate) wire: Wire,
    pub(crate) host: Host,
}

impl<'a> Bench<'a> {
    pub(crate) fn new(state: &'a mut State, flash: Flash) -> Self {
        let clock = TestClock::default();
        let device = Device::new(IDENTITY, SETTINGS, state, flash, clock.clone()).unwrap();
        Self {
            device,
            clock,
            wire: Wire::default(),
            host: Host::default(),
        }
    }

    /// A device whose session has begun.
    pub(crate) fn open(state: &'a mut State, flash: Flash) -> Self {
        let mut bench = Self::new(state, flash);
        assert!(matches!(bench.ask(Request::Hello), Reply::Info(_)));
        bench
    }

    pub(crate) fn exchange(&mut self, bytes: &[u8]) -> Vec<Response> {
        self.wire.to_device.extend(bytes);
        while self.device.poll(&mut self.wire).unwrap() {}
        self.host.receive(&mut self.wire)
    }

    /// All responses to a request. The reply must be the last of them.
    pub(crate) fn ask_all(&mut self, request: &Request) -> (Vec<Response>, Reply) {
        let (sequence, frame) = self.host.frame(request);
        let mut responses = self.exchange(&frame);
        match responses.pop() {
            Some(Response::Reply { request, reply }) if request == sequence => (responses, reply),
            other => panic!("{other:?} for {request:?}"),
        }
    }

    pub(crate) fn ask(&mut self, request: Request) -> Reply {
        let (others, reply) = self.ask_all(&request);
        assert_eq!(others, []);
        reply
    }

    pub(crate) fn info(&mut self) -> Info {
        match self.ask(Request::Info) {
            Reply::Info(info) => info,
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn status(&mut self) -> Status {
        match self.ask(Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    /// Sends the missing part of a table, up to the offset `until`.
    pub(crate) fn send(&mut self, file: &[u8], until: usize) -> Upload {
        let Reply::Upload(mut upload) = self.ask(Request::UploadBegin(Header::read(file).unwrap())) else {
            panic!("an upload")
        };
        while (upload.received as usize) < until {
            let from = upload.received as usize;
            let to = (from + MAX_CHUNK).min(until);
            let data = file[from..to].iter().copied().collect();
            match self.ask(Request::UploadChunk {
                offset: upload.received,
                data,
            }) {
                Reply::Upload(now) => upload = now,
                other => panic!("{other:?}"),
            }
        }
        upload
    }

    pub(crate) fn upload(&mut self, file: &[u8]) {
        self.send(file, file.len());
        assert_eq!(self.ask(Request::UploadCommit), Reply::Done);
    }
}
