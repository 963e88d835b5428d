//! QEMU with the emulated board: starts it, exchanges messages, feeds stimuli, ends it.
//!
//! The harness listens on its own sockets and QEMU connects to them, so that no other test can take a port number. Every wait
//! has a limit. The process ends when the [`Emulator`] is dropped.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::FileExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use quietcut::device::DeviceError;
use quietcut::device::port::Port;
use quietcut_firmware::stimulus::{
    FLASH_BYTES, MAX_FRAME_BYTES, MEMORY_BYTES, REFUSED, STORE_OFFSET, Stimulus, TAKEN,
};
use tempfile::TempDir;

use crate::command::alone;
use crate::device_log;
use crate::firmware_image;
use crate::pty::Pty;

/// Longest wait for a read from the link or an answer of the virtual sensor. On a busy machine a read takes some tenths of a
/// second, a stored recording some seconds.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// Options with which QEMU counts instructions: one instruction takes 2⁶ ns.
const COUNTING: [&str; 2] = ["-icount", "shift=6"];
const SECONDS_PER_INSTRUCTION: f64 = 64e-9;

/// Bytes of stimuli that are stored at a time. The board processes them in about a second, far below [`PATIENCE`].
const STORED_AT_ONCE: usize = 1024 * 1024;
const _: () = assert!(STORED_AT_ONCE <= MEMORY_BYTES - STORE_OFFSET);

/// Number of frames that are sent before their answers arrive. More are not faster, because the emulator takes single bytes.
const FRAMES_AHEAD: usize = 16;

/// The non-volatile memory of an emulated board: a file that outlives the emulator.
pub struct Memory {
    directory: TempDir,
}

impl Memory {
    /// The memory of a new board, with erased flash.
    pub fn erased() -> Self {
        let directory = TempDir::with_prefix("quietcut-memory-").expect("a temporary folder");
        let memory = Self { directory };
        fs::write(memory.path(), vec![0xff; FLASH_BYTES]).expect("a file for the board's memory");
        memory
            .open()
            .set_len(MEMORY_BYTES as u64)
            .expect("room for the board's memory");
        memory
    }

    /// The content of the flash.
    pub fn flash(&self) -> Vec<u8> {
        let mut flash = vec![0; FLASH_BYTES];
        self.open()
            .read_exact_at(&mut flash, 0)
            .expect("the board's memory");
        flash
    }

    /// Overwrites bytes of the flash without the device.
    pub fn damage(&self, offset: usize, bytes: &[u8]) {
        assert!(offset + bytes.len() <= FLASH_BYTES, "damage outside of the flash");
        self.open()
            .write_all_at(bytes, offset as u64)
            .expect("the board's memory");
    }

    fn store(&self, stimuli: &[u8]) {
        self.open()
            .write_all_at(stimuli, STORE_OFFSET as u64)
            .expect("the board's memory");
    }

    fn path(&self) -> PathBuf {
        self.directory.path().join("memory.bin")
    }

    fn open(&self) -> File {
        OpenOptions::new()
            .read(true)
            .write(true)
            .open(self.path())
            .expect("the board's memory")
    }
}

/// A running emulator.
pub struct Emulator<'m> {
    memory: &'m Memory,
    process: Child,
    directory: TempDir,
    link: UnixStream,
    spindle: UnixStream,
}

impl<'m> Emulator<'m> {
    /// Starts the emulated board with this memory.
    pub fn start(memory: &'m Memory) -> Self {
        Self::start_with(memory, &[])
    }

    /// Starts the emulated board with a clock that counts instructions.
    pub fn start_counting(memory: &'m Memory) -> Self {
        Self::start_with(memory, &COUNTING)
    }

    fn start_with(memory: &'m Memory, options: &[&str]) -> Self {
        let image = firmware_image::qemu_mps2();
        let directory = TempDir::with_prefix("quietcut-emulator-").expect("a temporary folder");
        let listen = |name| UnixListener::bind(directory.path().join(name)).expect("a socket");
        let (link, spindle) = (listen("link"), listen("spindle"));
        let mut command = qemu(&image);
        command
            .args(board_options(&memory.path(), directory.path()))
            .args(options)
            .stdout(Stdio::null());
        let mut process = spawn(command);
        let link = accept(&link, &mut process);
        let spindle = accept(&spindle, &mut process);
        let mut emulator = Self {
            memory,
            process,
            directory,
            link,
            spindle,
        };
        emulator.wait_for_start();
        emulator
    }

    /// Waits for the first complete log entry, which the device writes when its ports are open.
    fn wait_for_start(&mut self) {
        let began = Instant::now();
        // A log frame ends with a zero byte; another zero may precede it.
        while !fs::read(self.log_path()).is_ok_and(|log| log.len() > 1 && log.ends_with(&[0])) {
            let end = self.end();
            assert!(
                end.is_empty() && began.elapsed() < PATIENCE,
                "the device does not start{end}"
            );
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// The link to the device, as a stream of bytes with a limit on every wait.
    pub fn link(&self) -> UnixStream {
        self.link.try_clone().expect("a second handle of the link")
    }

    /// The link as a port of the host's client.
    pub fn port(&self) -> SocketPort {
        SocketPort(self.link())
    }

    /// The link as a serial device, for programs that open one. It must not be used together with [`Self::link`].
    pub fn serial_device(&self) -> Pty {
        Pty::to_socket(self.link())
    }

    /// Sends stimuli over the board's serial port. Returns once the signal chain has processed all of them.
    pub fn feed(&mut self, stimuli: &[Stimulus]) {
        let mut frame = [0; MAX_FRAME_BYTES];
        for ahead in stimuli.chunks(FRAMES_AHEAD) {
            for stimulus in ahead {
                let frame = postcard::to_slice_cobs(stimulus, &mut frame).expect("room for a stimulus");
                self.spindle.write_all(frame).expect("the emulator takes stimuli");
            }
            self.expect_taken(ahead.len());
        }
    }

    /// Sends bytes in place of a stimulus. Returns true if the board accepts them.
    pub fn takes_frame(&mut self, bytes: &[u8]) -> bool {
        self.spindle.write_all(bytes).expect("the emulator takes bytes");
        let mut answer = [0];
        self.spindle.read_exact(&mut answer).expect("the board answers");
        answer == [TAKEN]
    }

    /// Passes stimuli through the board's memory, for long recordings.
    pub fn feed_stored(&mut self, stimuli: &[Stimulus]) {
        let mut store = Vec::new();
        for stimulus in stimuli {
            let mut bytes = [0; MAX_FRAME_BYTES];
            let bytes = postcard::to_slice(stimulus, &mut bytes).expect("room for a stimulus");
            if store.len() + bytes.len() > STORED_AT_ONCE {
                self.pass_store(&store);
                store.clear();
            }
            store.extend_from_slice(bytes);
        }
        self.pass_store(&store);
    }

    /// The cost of the device since its start.
    pub fn cost(&mut self) -> Cost {
        self.feed(&[Stimulus::AskCost]);
        let log = self.log();
        let line = log.lines().rev().find_map(|line| line.split_once("cost: "));
        let numbers = line.map(|(_, line)| {
            let words = line.split(|c: char| !c.is_ascii_digit());
            words.filter_map(|word| word.parse().ok()).collect::<Vec<u64>>()
        });
        let Some(&[stack_bytes, blocks, ticks, most_ticks, request_ticks, flash_ticks]) = numbers.as_deref()
        else {
            panic!("no cost in the log:\n{log}")
        };
        // The board's timer runs at 25 MHz.
        let seconds = |ticks: u64| ticks as f64 / 25e6;
        Cost {
            stack_bytes: stack_bytes as usize,
            mean_s: seconds(ticks) / blocks.max(1) as f64,
            most_s: seconds(most_ticks),
            request_s: seconds(request_ticks),
            flash_s: seconds(flash_ticks),
        }
    }

    fn pass_store(&mut self, store: &[u8]) {
        self.memory.store(store);
        let bytes = store.len() as u32;
        self.feed(&[Stimulus::Stored { bytes }]);
    }

    fn expect_taken(&mut self, count: usize) {
        let mut answers = [0; FRAMES_AHEAD];
        let answers = &mut answers[..count];
        if let Err(error) = self.spindle.read_exact(answers) {
            panic!("no answer to a stimulus: {error}{}", self.end());
        }
        for &answer in &*answers {
            assert_ne!(answer, REFUSED, "the board refused a stimulus");
            assert_eq!(answer, TAKEN, "unknown answer to a stimulus");
        }
    }

    /// Ends the emulator, which cuts the power of the board.
    pub fn kill(mut self) {
        self.stop();
    }

    /// The log of the device so far, one line per entry.
    pub fn log(&self) -> String {
        let frames = fs::read(self.log_path()).unwrap_or_default();
        device_log::decode(&firmware_image::qemu_mps2(), &frames)
    }

    fn log_path(&self) -> PathBuf {
        self.directory.path().join("log")
    }

    /// How the emulator has ended, if it has.
    fn end(&mut self) -> String {
        match self.process.try_wait() {
            Ok(Some(status)) => format!("; the emulator has ended: {status}"),
            _ => String::new(),
        }
    }

    fn stop(&mut self) {
        // Fails if the process has already ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Drop for Emulator<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let end = self.end();
            eprintln!("--- log of the emulated device{end}\n{}---", self.log());
        }
        self.stop();
    }
}

/// Costs of the device.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Largest stack depth in bytes, without the frame of the main function.
    pub stack_bytes: usize,
    /// Mean processing time of a block, s.
    pub mean_s: f64,
    /// Longest processing time of a block, s.
    pub most_s: f64,
    /// Longest time of a request without flash operations, s.
    pub request_s: f64,
    /// Longest time of the flash operations of one request, s.
    pub flash_s: f64,
}

impl Cost {
    /// Mean and largest number of instructions of a block, if the emulator counts them.
    pub fn instructions(&self) -> (f64, f64) {
        (
            self.mean_s / SECONDS_PER_INSTRUCTION,
            self.most_s / SECONDS_PER_INSTRUCTION,
        )
    }

    /// Largest number of instructions of a request without flash operations, if the emulator counts them.
    pub fn request_instructions(&self) -> f64 {
        self.request_s / SECONDS_PER_INSTRUCTION
    }
}

/// The link to an emulated device, for the host's client.
pub struct SocketPort(UnixStream);

impl Port for SocketPort {
    fn name(&self) -> &str {
        "the emulator"
    }

    fn send(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), DeviceError> {
        let sent = self
            .0
            .set_write_timeout(Some(timeout))
            .and_then(|()| self.0.write_all(bytes));
        sent.map_err(|_| self.unplugged())
    }

    fn receive(&mut self, into: &mut [u8], timeout: Duration) -> Result<usize, DeviceError> {
        // A socket refuses a timeout of zero.
        let timeout = timeout.max(Duration::from_micros(1));
        let received = self
            .0
            .set_read_timeout(Some(timeout))
            .and_then(|()| self.0.read(into));
        match received {
            Ok(count) if count > 0 => Ok(count),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(0),
            _ => Err(self.unplugged()),
        }
    }
}

impl SocketPort {
    fn unplugged(&self) -> DeviceError {
        DeviceError::Unplugged {
            port: self.name().into(),
        }
    }
}

/// Runs the image that counts instructions until it ends. Returns the printed counts by name.
pub fn count_instructions() -> BTreeMap<String, u64> {
    let printed = printed_counts(&firmware_image::count_instructions(), PATIENCE);
    let count = |line: &str| -> Option<(String, u64)> {
        let (name, count) = line.rsplit_once(' ')?;
        Some((name.to_owned(), count.parse().ok()?))
    };
    printed
        .lines()
        .map(|line| count(line).unwrap_or_else(|| panic!("not a count: {line}")))
        .collect()
}

/// Runs an image that counts until it ends, within `patience`. Returns what it printed.
pub fn printed_counts(image: &Path, patience: Duration) -> String {
    let mut command = qemu(image);
    command
        .args(["-M", "mps2-an386", "-serial", "null"])
        .args(COUNTING)
        .stdout(Stdio::piped());
    let mut process = spawn(command);
    let began = Instant::now();
    let status = loop {
        match process.try_wait().expect("the emulator's state") {
            Some(status) => break status,
            None if began.elapsed() > patience => {
                let _ = process.kill();
                let _ = process.wait();
                panic!("{} did not end within {patience:?}", image.display());
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let mut printed = String::new();
    if let Some(mut output) = process.stdout.take() {
        output
            .read_to_string(&mut printed)
            .expect("what the image printed");
    }
    assert!(status.success(), "the counting image failed: {status}\n{printed}");
    printed
}

/// Options of QEMU for every image: no window, semihosting, and the image itself behind the last one.
const FOR_IMAGES: [&str; 7] = [
    "-display",
    "none",
    "-monitor",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
    "-kernel",
];

/// Options of QEMU for the board: its memory in a file, and link, log and virtual spindle as files of `folder`.
fn board_options(memory: &Path, folder: &Path) -> Vec<String> {
    let path = |name: &str| folder.join(name).display().to_string();
    let memory = memory.display();
    [
        "-M",
        "mps2-an386,memory-backend=psram",
        "-object",
        &format!("memory-backend-file,id=psram,size={MEMORY_BYTES},mem-path={memory},share=on"),
        "-chardev",
        &format!("socket,id=link,path={}", path("link")),
        "-serial",
        "chardev:link",
        "-serial",
        &format!("file:{}", path("log")),
        "-chardev",
        &format!("socket,id=spindle,path={}", path("spindle")),
        "-serial",
        "chardev:spindle",
    ]
    .map(str::to_owned)
    .into()
}

/// The command line that starts the board with this image, with all files in the current folder.
pub fn command_line(image: &str) -> Vec<String> {
    let of_image = ["qemu-system-arm"].into_iter().chain(FOR_IMAGES).chain([image]);
    let options = board_options(Path::new("memory.bin"), Path::new(""));
    of_image.map(str::to_owned).chain(options).collect()
}

fn qemu(image: &Path) -> Command {
    let mut command = Command::new("qemu-system-arm");
    command
        .args(FOR_IMAGES)
        .arg(image)
        .stdin(Stdio::null())
        .stderr(Stdio::piped());
    command
}

fn spawn(mut command: Command) -> Child {
    let _alone = alone();
    match command.spawn() {
        Ok(process) => process,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            panic!("qemu-system-arm was not found: install the package qemu-system-arm, or run tests/run")
        }
        Err(error) => panic!("qemu-system-arm does not start: {error}"),
    }
}

/// Waits until QEMU connects. Panics with the reason if it ends before.
fn accept(listener: &UnixListener, process: &mut Child) -> UnixStream {
    listener.set_nonblocking(true).expect("a socket without waiting");
    let began = Instant::now();
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false).expect("a socket with waiting");
                stream
                    .set_read_timeout(Some(PATIENCE))
                    .expect("a limit on reading");
                stream
                    .set_write_timeout(Some(PATIENCE))
                    .expect("a limit on writing");
                return stream;
            }
            Err(error) if error.kind() != ErrorKind::WouldBlock => panic!("the emulator's socket: {error}"),
            Err(_) => {}
        }
        if let Ok(Some(status)) = process.try_wait() {
            let mut said = String::new();
            if let Some(mut output) = process.stderr.take() {
                let _ = output.read_to_string(&mut said);
            }
            panic!("qemu-system-arm ended at once: {status}\n{said}");
        }
        if began.elapsed() > PATIENCE {
            let _ = process.kill();
            let _ = process.wait();
            panic!("qemu-system-arm did not open its serial ports within {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
