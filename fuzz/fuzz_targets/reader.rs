//! `DIDIM_READER=NAME cargo +nightly fuzz run reader fuzz/corpus/NAME`.
#![no_main]

use std::sync::OnceLock;

#[path = "../../tests/readers/list.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    static READ: OnceLock<fn(&[u8])> = OnceLock::new();
    let read = READ.get_or_init(|| {
        // libFuzzer's hook ends the process also at a panic that the program catches. Without the
        // hook, only one that it does not catch does.
        drop(std::panic::take_hook());
        let name = std::env::var("DIDIM_READER").expect("DIDIM_READER names a reader");
        let reader = readers::READERS.iter().find(|reader| reader.name == name);
        reader.expect("DIDIM_READER is none of tests/readers/list.rs").read
    });
    read(bytes);
});
