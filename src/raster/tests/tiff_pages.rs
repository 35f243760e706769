//! Files of several pictures: the full one is found, a thumbnail is never taken for it.

use super::tiff::{PLAIN, Page, Value};
use super::{check_unsupported, decoded};

fn page(size: u16) -> Page {
    Page::new([size, size], 1, 8, 1, vec![size as u8; usize::from(size) * usize::from(size)])
}

fn check(pages: &[Page], expected: usize) {
    assert_eq!(decoded(&PLAIN.file(pages)).width, expected);
}

#[test]
fn the_full_picture_is_found() {
    // By its own word, and by its size.
    check(&[page(40).short(254, 1), page(60)], 60);
    check(&[page(60), page(40).short(254, 1)], 60);
    check(&[page(8), page(60)], 60);
    check(&[page(60), page(30), page(15)], 60);
    // A transparency mask belongs to the picture beside it.
    check(&[page(60), page(60).short(254, 4)], 60);
}

#[test]
fn several_pictures_are_refused() {
    check_unsupported(&PLAIN.file(&[page(60), page(60), page(60)]), "a TIFF of 3 pictures");
    check_unsupported(&PLAIN.file(&[page(60), page(50)]), "a TIFF of 2 pictures");
}

#[test]
fn a_thumbnail_alone_is_refused() {
    check_unsupported(&PLAIN.file(&[page(40).short(254, 1)]), "a reduced copy (40 x 40)");
    check_unsupported(&PLAIN.file(&[page(60).short(254, 4)]), "transparency mask");
    // The sensor's data in a tag of the maker's own, as in IIQ.
    let raw = page(1).with(0x927c, Value::Bytes(vec![3; 200_000]));
    check_unsupported(&PLAIN.file(&[raw]), "a reduced copy (1 x 1)");
    // A profile beside a small picture is no sensor data.
    check(&[page(1).with(34_675, Value::Bytes(vec![3; 200_000]))], 1);
}

#[test]
fn directories_in_a_loop_end() {
    let mut file = PLAIN.file(&[page(4)]);
    let first = file[4..8].to_vec();
    let end = file.len();
    file[end - 4..].copy_from_slice(&first);
    assert_eq!(decoded(&file).width, 4);
}
