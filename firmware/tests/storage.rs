//! The table slots: uploads, resumed uploads, and a loss of power at every operation.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::cell::Cell;
use std::rc::Rc;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use proptest::prelude::*;
use quietcut_core::lobes::{Header, TableError};
use quietcut_core::protocol::{Refusal, Slot, Upload};
use quietcut_firmware::flash_model::FlashModel;
use quietcut_firmware::storage::{Storage, TableMemory};
use support::{content_of, table};

const HEADER: usize = 32;

/// Flash like that of the board, but smaller: 16 pages of 256 bytes, words of 8 bytes.
type Flash = FlashModel<Vec<u8>, 8, 256>;
const BYTES: usize = 16 * 256;

fn empty() -> Flash {
    Flash::new(vec![0xFF; BYTES])
}

/// Uploads a table like a host: from the offset that the device states, in chunks of `piece` bytes.
fn send<M: TableMemory>(storage: &mut Storage<M>, file: &[u8], piece: usize) -> Result<(), Refusal> {
    let mut upload = storage.begin(Header::read(file).unwrap())?;
    while (upload.received as usize) < file.len() {
        let rest = &file[upload.received as usize..];
        upload = storage.chunk(upload.received, &rest[..piece.min(rest.len())])?;
    }
    storage.commit()
}

fn assert_holds<M: TableMemory>(storage: &Storage<M>, file: &[u8]) {
    let table = storage.table().unwrap();
    assert_eq!(content_of(&table), file[HEADER..]);
}

fn name_in_use<M: TableMemory>(storage: &Storage<M>) -> Option<String> {
    storage.table().map(|table| table.name().to_owned())
}

#[test]
fn new_flash_holds_nothing() {
    let mut storage = Storage::new(empty());
    assert!(storage.table().is_none());
    assert_eq!(storage.slots(), [Slot::Empty; 2]);
    assert_eq!(storage.slot_capacity(), 7 * 256);
    assert_eq!(storage.upload(), Err(Refusal::NoUpload));
    assert_eq!(storage.chunk(32, &[1]), Err(Refusal::NoUpload));
    assert_eq!(storage.commit(), Err(Refusal::NoUpload));
    assert_eq!(storage.abort(), Err(Refusal::NoUpload));
}

#[test]
fn uploads_change_slots_and_the_newest_is_found_again() {
    let mut storage = Storage::new(empty());
    let files: Vec<Vec<u8>> = (0..5_u8)
        .map(|k| table(&format!("case-{k}"), 1.0 + f32::from(k), 60 + u16::from(k)))
        .collect();
    for (index, file) in files.iter().enumerate() {
        send(&mut storage, file, 100).unwrap();
        assert_holds(&storage, file);
        let generation = index as u32 + 1;
        let in_use = storage.slots()[index % 2];
        assert!(
            matches!(in_use, Slot::InUse(header) if header.generation == generation),
            "{in_use:?}"
        );
        if index > 0 {
            assert!(
                matches!(storage.slots()[1 - index % 2], Slot::Valid(header) if header.generation == generation - 1)
            );
        }
        storage = Storage::new(Flash::new(storage.into_memory().into_bytes()));
        assert_holds(&storage, file);
    }
}

#[test]
fn every_word_and_page_size_works() {
    fn check<const WRITE: usize, const ERASE: usize>() {
        let mut storage = Storage::new(FlashModel::<_, WRITE, ERASE>::new(vec![0xFF; 8 * 4096]));
        for piece in [1, 7, 64, 255, 256] {
            for (name, speeds) in [("a", 40), ("b", 41), ("c", 200)] {
                let file = table(name, 2.0, speeds);
                send(&mut storage, &file, piece).unwrap();
                assert_holds(&storage, &file);
            }
        }
        let bytes = storage.into_memory().into_bytes();
        let storage = Storage::new(FlashModel::<_, WRITE, ERASE>::new(bytes));
        assert_eq!(name_in_use(&storage).as_deref(), Some("c"));
    }
    check::<1, 4096>();
    check::<2, 1024>();
    check::<4, 256>();
    check::<8, 2048>();
    check::<16, 512>();
    // The table has more pages than the journal has room for marks.
    check::<32, 96>();
    check::<8, 96>();
}

#[test]
fn generation_numbers_wrap() {
    let mut bytes = vec![0xFF; BYTES];
    for (slot, generation) in [(0, u32::MAX), (1, 0)] {
        let file = table(&format!("generation-{generation}"), 2.0, 60);
        let header = Header::read(&file)
            .unwrap()
            .with_generation(generation, &file[HEADER..]);
        let start = slot * BYTES / 2;
        bytes[start..start + file.len()].copy_from_slice(&file);
        bytes[start..start + HEADER].copy_from_slice(&header.to_bytes());
    }
    let mut storage = Storage::new(Flash::new(bytes));
    assert_eq!(name_in_use(&storage).as_deref(), Some("generation-0"));
    let file = table("next", 2.0, 60);
    send(&mut storage, &file, 256).unwrap();
    assert!(matches!(storage.slots()[0], Slot::InUse(header) if header.generation == 1));
}

#[test]
fn a_refused_upload_leaves_the_table_in_use() {
    let old = table("old", 1.0, 60);
    let mut storage = Storage::new(empty());
    send(&mut storage, &old, 100).unwrap();
    let new = table("new", 2.0, 70);
    let header = Header::read(&new).unwrap();
    let length = header.length;

    let too_long = Header {
        length: 7 * 256 + 1,
        ..header
    };
    let refusal = Refusal::TableTooLong {
        length: 7 * 256 + 1,
        capacity: 7 * 256,
    };
    assert_eq!(storage.begin(too_long), Err(refusal));
    let schema = TableError::Schema { found: 9, known: 3 };
    assert_eq!(
        storage.begin(Header { schema: 9, ..header }),
        Err(Refusal::Table(schema))
    );
    let short = TableError::TooShort {
        needed: 33,
        found: 32,
    };
    assert_eq!(
        storage.begin(Header { length: 32, ..header }),
        Err(Refusal::Table(short))
    );

    assert_eq!(storage.begin(header), Ok(Upload { header, received: 32 }));
    let offset = |expected, found| {
        Err(Refusal::ChunkOffset {
            expected,
            found,
            length,
        })
    };
    assert_eq!(storage.chunk(0, &new[..100]), offset(32, 0));
    assert_eq!(storage.chunk(40, &new[40..100]), offset(32, 40));
    assert_eq!(
        storage.chunk(32, &new[32..100]),
        Ok(Upload {
            header,
            received: 100
        })
    );
    assert_eq!(storage.chunk(32, &new[32..100]), offset(100, 32));
    assert_eq!(storage.chunk(100, &vec![0; new.len()]), offset(100, 100));
    assert_eq!(
        storage.commit(),
        Err(Refusal::Incomplete {
            received: 100,
            length
        })
    );
    // The upload continues after it was begun again.
    assert_eq!(
        storage.upload(),
        Ok(Upload {
            header,
            received: 100
        })
    );
    assert_eq!(
        storage.begin(header),
        Ok(Upload {
            header,
            received: 100
        })
    );
    assert_eq!(storage.abort(), Ok(()));
    assert_eq!(storage.upload(), Err(Refusal::NoUpload));
    assert_eq!(storage.slots()[1], Slot::Empty);
    assert_holds(&storage, &old);

    // A byte has changed during the upload.
    let mut damaged = new.clone();
    damaged[200] ^= 1;
    let Err(Refusal::Table(TableError::Crc { .. })) = send(&mut storage, &damaged, 256) else {
        panic!("a CRC error")
    };
    assert_holds(&storage, &old);
    assert_eq!(storage.slots()[1], Slot::Empty);

    // An invalid table with a valid CRC: the number of teeth is 0.
    let mut toothless = new.clone();
    toothless[HEADER] = 0;
    let crc = Header::read(&toothless)
        .unwrap()
        .with_generation(0, &toothless[HEADER..]);
    toothless[..HEADER].copy_from_slice(&crc.to_bytes());
    assert_eq!(
        send(&mut storage, &toothless, 256),
        Err(Refusal::Table(TableError::Teeth))
    );
    assert_holds(&storage, &old);
    let storage = Storage::new(Flash::new(storage.into_memory().into_bytes()));
    assert_holds(&storage, &old);
}

/// Flash that counts its erased pages.
struct Counting {
    flash: Flash,
    erased: Rc<Cell<u32>>,
}

impl ErrorType for Counting {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Counting {
    const READ_SIZE: usize = Flash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Counting {
    const WRITE_SIZE: usize = Flash::WRITE_SIZE;
    const ERASE_SIZE: usize = Flash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.erased
            .set(self.erased.get() + (to - from) / Self::ERASE_SIZE as u32);
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.flash.write(offset, bytes)
    }
}

impl TableMemory for Counting {
    fn mapped(&self) -> &[u8] {
        self.flash.mapped()
    }
}

#[test]
fn no_request_erases_more_than_a_page() {
    // An eighth of a page, as the longest chunk is of a page of the board. A longer piece would touch two pages from their
    // second word on.
    const PIECE: usize = 32;
    let erased = Rc::new(Cell::new(0));
    let mut storage = Storage::new(Counting {
        flash: empty(),
        erased: erased.clone(),
    });
    let spent = || {
        let pages = erased.take();
        assert!(pages <= 1, "{pages} pages");
        pages
    };
    let mut all = 0;
    for (name, speeds) in [("first", 60), ("second", 90), ("third", 70), ("fourth", 80)] {
        let file = table(name, 1.0, speeds);
        let mut upload = storage.begin(Header::read(&file).unwrap()).unwrap();
        all += spent();
        while (upload.received as usize) < file.len() {
            let rest = &file[upload.received as usize..];
            upload = storage
                .chunk(upload.received, &rest[..rest.len().min(PIECE)])
                .unwrap();
            all += spent();
        }
        // The upload of the third table is aborted.
        if name == "third" {
            storage.abort().unwrap();
        } else {
            storage.commit().unwrap();
        }
        all += spent();
    }
    let mut wrong = table("wrong", 1.0, 60);
    wrong[200] ^= 1;
    storage.begin(Header::read(&wrong).unwrap()).unwrap();
    all += spent();
    for (index, piece) in wrong[HEADER..].chunks(PIECE).enumerate() {
        storage.chunk((HEADER + PIECE * index) as u32, piece).unwrap();
        all += spent();
    }
    assert!(matches!(
        storage.commit(),
        Err(Refusal::Table(TableError::Crc { .. }))
    ));
    all += spent();
    // Each table has three to five pages; journals add to them.
    assert!(all > 20, "{all} pages");
}

#[test]
fn a_table_stays_valid_until_its_pages_are_needed() {
    let mut storage = Storage::new(empty());
    send(&mut storage, &table("older", 1.0, 60), 100).unwrap();
    send(&mut storage, &table("newer", 1.0, 60), 100).unwrap();
    let next = table("next", 1.0, 60);
    let header = Header::read(&next).unwrap();
    storage.begin(header).unwrap();
    assert!(matches!(storage.slots()[0], Slot::Unfinished(_)));
    storage.abort().unwrap();
    assert!(matches!(storage.slots()[0], Slot::Valid(_)));
    storage.begin(header).unwrap();
    storage.chunk(32, &next[32..100]).unwrap();
    storage.abort().unwrap();
    assert_eq!(storage.slots()[0], Slot::Empty);
    assert_eq!(name_in_use(&storage).as_deref(), Some("newer"));
}

#[test]
fn another_table_replaces_an_unfinished_one() {
    let mut storage = Storage::new(empty());
    let (first, second) = (table("first", 1.0, 70), table("second", 1.0, 71));
    storage.begin(Header::read(&first).unwrap()).unwrap();
    storage.chunk(32, &first[32..700]).unwrap();
    let header = Header::read(&second).unwrap();
    assert_eq!(storage.begin(header), Ok(Upload { header, received: 32 }));
    send(&mut storage, &second, 256).unwrap();
    assert_holds(&storage, &second);
}

#[test]
fn a_damaged_slot_is_detected_and_the_other_is_used() {
    let mut storage = Storage::new(empty());
    send(&mut storage, &table("old", 1.0, 60), 100).unwrap();
    send(&mut storage, &table("new", 2.0, 60), 100).unwrap();
    let mut bytes = storage.into_memory().into_bytes();
    bytes[BYTES / 2 + 300] ^= 4;
    let storage = Storage::new(Flash::new(bytes));
    assert_eq!(name_in_use(&storage).as_deref(), Some("old"));
    assert!(matches!(
        storage.slots()[1],
        Slot::Damaged(TableError::Crc { .. })
    ));
}

#[test]
fn a_memory_too_small_holds_nothing() {
    let mut storage = Storage::new(Flash::new(vec![0xFF; 2 * 256]));
    let header = Header::read(&table("a", 1.0, 60)).unwrap();
    let refusal = Refusal::TableTooLong {
        length: header.length,
        capacity: 0,
    };
    assert_eq!(storage.begin(header), Err(refusal));
    assert!(storage.table().is_none());
}

/// Cuts the power during every write and erase of an upload in chunks of `piece` bytes, with several random contents left behind
/// each time.
fn cut_power_everywhere(piece: usize) {
    let (old, new) = (table("old", 1.0, 60), table("new", 2.0, 90));
    let mut with_old = Storage::new(empty());
    send(&mut with_old, &table("older", 1.5, 50), 100).unwrap();
    send(&mut with_old, &old, 100).unwrap();
    let before = with_old.into_memory().into_bytes();
    let slot_in_use = BYTES / 2..BYTES / 2 + old.len();

    let (mut cuts, mut resumed, mut new_in_use) = (0, 0, 0);
    for operation in 0.. {
        let mut is_done = false;
        for noise in 1..=64_u64 {
            let mut flash = Flash::new(before.clone());
            flash.fail_after(operation, noise.wrapping_mul(0x9E37_79B9_7F4A_7C15));
            let mut storage = Storage::new(flash);
            let sent = send(&mut storage, &new, piece);
            let flash = storage.into_memory();
            if !flash.is_off() {
                assert_eq!(sent, Ok(()));
                is_done = true;
                break;
            }
            cuts += 1;
            let bytes = flash.into_bytes();
            assert_eq!(
                bytes[slot_in_use.clone()],
                before[slot_in_use.clone()],
                "operation {operation}"
            );

            let mut storage = Storage::new(Flash::new(bytes));
            match name_in_use(&storage).as_deref() {
                Some("old") => assert_holds(&storage, &old),
                Some("new") => {
                    assert_holds(&storage, &new);
                    new_in_use += 1;
                }
                other => panic!("operation {operation}, noise {noise}: {other:?} is in use"),
            }
            if let Ok(upload) = storage.upload() {
                assert_eq!(upload.header, Header::read(&new).unwrap());
                resumed += u32::from(upload.received > HEADER as u32);
            }
            // After every loss of power the upload succeeds.
            send(&mut storage, &new, piece).unwrap();
            assert_holds(&storage, &new);
        }
        if is_done {
            assert!(operation > 15, "{operation} operations");
            break;
        }
    }
    println!("pieces of {piece}: {cuts} cuts, {resumed} resumed, new table in use after {new_in_use}");
    // Most losses of power come after the first page. Only the last one, within the header, may come too late to have an effect.
    assert!(resumed > cuts / 2 && new_in_use < 64);
}

#[test]
fn power_may_fail_at_every_operation() {
    // Chunks that end within words, at words, and at pages.
    for piece in [45, 100, 128, 256] {
        cut_power_everywhere(piece);
    }
}

proptest! {
    #[test]
    fn power_may_fail_again_and_again(
        cuts in prop::collection::vec((0_u32..40, any::<u64>(), 1_usize..300), 1..12),
        sizes in prop::collection::vec(20_u16..90, 3),
    ) {
        let files: Vec<Vec<u8>> =
            sizes.iter().enumerate().map(|(k, &speeds)| table(&format!("case-{k}"), 1.0, speeds)).collect();
        let mut bytes = vec![0xFF; BYTES];
        let mut in_use: Option<usize> = None;
        for (index, (operations, noise, piece)) in cuts.into_iter().enumerate() {
            // The next upload is the same table or another one.
            let which = (index / 2) % files.len();
            let mut flash = Flash::new(bytes);
            flash.fail_after(operations, noise);
            let mut storage = Storage::new(flash);
            prop_assert_eq!(name_in_use(&storage), in_use.map(|which| format!("case-{which}")));
            let sent = send(&mut storage, &files[which], piece);
            bytes = storage.into_memory().into_bytes();
            let storage = Storage::new(Flash::new(bytes.clone()));
            let found = name_in_use(&storage);
            let new = Some(format!("case-{which}"));
            if sent.is_ok() || found == new {
                prop_assert_eq!(&found, &new);
                in_use = Some(which);
            } else {
                prop_assert_eq!(&found, &in_use.map(|which| format!("case-{which}")));
            }
            if let Some(which) = in_use {
                assert_holds(&storage, &files[which]);
            }
        }
        let mut storage = Storage::new(Flash::new(bytes));
        send(&mut storage, &files[2], 128).unwrap();
        assert_holds(&storage, &files[2]);
    }
}
