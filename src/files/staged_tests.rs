use super::*;

const KIND: OutputKind = OutputKind { name: "solution", marker: Some("report.json") };

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Writes an output with a folder in it.
fn write(target: &Path, content: &str) -> Result<(), FileError> {
    let staged = StagedFolder::create(target, KIND)?;
    fs::create_dir(staged.join("mips")).unwrap();
    for name in ["report.json", "normal.exr", "mips/normal-1.exr"] {
        fs::write(staged.join(name), content).unwrap();
    }
    staged.commit()
}

/// What writing again says after `change` was made to an output; the output then is as `change` left it.
fn check_refused(change: fn(&Path), expected: &str) {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    write(&target, "old").unwrap();
    change(&target);
    let before = (names(&target), names(&target.join("mips")));
    let said = write(&target, "new").unwrap_err().to_string();
    assert!(said.contains(expected), "{said}");
    assert!(said.contains("only an earlier solution and nothing else would be replaced"), "{said}");
    assert_eq!((names(&target), names(&target.join("mips"))), before);
    assert_eq!(names(home.path()), ["out"]);
}

#[test]
fn an_output_as_it_was_written_is_replaced() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    write(&target, "first").unwrap();
    write(&target, "second").unwrap();
    assert_eq!(fs::read_to_string(target.join("mips/normal-1.exr")).unwrap(), "second");
    // What the user deleted is no reason to refuse, nor is what a killed process left.
    fs::remove_file(target.join("normal.exr")).unwrap();
    fs::write(target.join(".weavelight-lock"), "").unwrap();
    fs::write(target.join(".weavelight-partial-abc123"), "half").unwrap();
    write(&target, "third").unwrap();
    assert_eq!(names(&target), [LIST_FILE, "mips", "normal.exr", "report.json"]);
    assert_eq!(names(home.path()), ["out"]);
}

#[test]
fn what_is_not_ours_is_named_and_stays() {
    check_refused(
        |out| fs::write(out.join("residual-notes.txt"), "mine").unwrap(),
        "holds residual-notes.txt, which weavelight did not write",
    );
    check_refused(
        |out| fs::write(out.join("mips/.hidden"), "mine").unwrap(),
        "holds mips/.hidden, which weavelight did not write",
    );
    check_refused(
        |out| fs::write(out.join("normal.exr"), "mine").unwrap(),
        "holds normal.exr, changed since weavelight wrote it",
    );
    check_refused(
        |out| {
            fs::remove_file(out.join("normal.exr")).unwrap();
            fs::create_dir(out.join("normal.exr")).unwrap();
        },
        "holds normal.exr, which weavelight did not write",
    );
    check_refused(|out| fs::create_dir(out.join("empty")).unwrap(), "holds empty, which");
    check_refused(
        |out| fs::remove_file(out.join(LIST_FILE)).unwrap(),
        "no .weavelight-files says that weavelight wrote it",
    );
    check_refused(
        |out| fs::remove_file(out.join("report.json")).unwrap(),
        "is not a solution (no report.json in it); only",
    );
    check_refused(
        |out| {
            for k in 0..9 {
                fs::write(out.join(format!("note-{k}")), "mine").unwrap();
            }
        },
        "holds note-0 and 8 more, which",
    );
}

#[cfg(unix)]
#[test]
fn links_are_in_the_way() {
    use std::os::unix::fs::symlink;
    check_refused(
        |out| {
            fs::rename(out.join("normal.exr"), out.with_file_name("kept")).unwrap();
            symlink(out.with_file_name("kept"), out.join("normal.exr")).unwrap();
            fs::rename(out.with_file_name("kept"), out.join("mips/kept")).unwrap();
        },
        "holds mips/kept, normal.exr, which weavelight did not write",
    );
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    symlink(home.path().join("nowhere"), &target).unwrap();
    let said = write(&target, "new").unwrap_err().to_string();
    assert!(said.contains("is a link to ") && said.contains(", which is not there"), "{said}");
}

#[test]
fn what_came_during_the_work_is_found_at_its_end() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    write(&target, "old").unwrap();
    let staged = StagedFolder::create(&target, KIND).unwrap();
    fs::write(staged.join("report.json"), "new").unwrap();
    fs::write(target.join("mips/normal-1.exr"), "own").unwrap();
    let said = staged.commit().unwrap_err().to_string();
    assert!(said.contains("holds mips/normal-1.exr, changed"), "{said}");
    assert_eq!(fs::read_to_string(target.join("report.json")).unwrap(), "old");
    assert_eq!(names(home.path()), ["out"]);
}

#[test]
fn a_folder_of_somebody_or_of_another_kind_is_not_replaced() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    fs::create_dir(&target).unwrap();
    write(&target, "new").unwrap();
    let other = OutputKind { name: "benchmark", marker: Some("bench.json") };
    let said = StagedFolder::create(&target, other).unwrap_err().to_string();
    assert!(said.contains("only an earlier benchmark"), "{said}");
    let never = OutputKind { name: "capture session", marker: None };
    let said = StagedFolder::create(&target, never).unwrap_err().to_string();
    assert!(said.contains("a capture session is never replaced"), "{said}");
    let file = target.join("report.json");
    let said = StagedFolder::create(&file, KIND).unwrap_err().to_string();
    assert!(said.contains("is a file"), "{said}");
}

#[test]
fn dropping_leaves_the_old_output_and_no_new_parents() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    write(&target, "old").unwrap();
    let staged = StagedFolder::create(&target, KIND).unwrap();
    fs::write(staged.join("report.json"), "new").unwrap();
    drop(staged);
    assert_eq!(fs::read_to_string(target.join("report.json")).unwrap(), "old");
    drop(StagedFolder::create(&home.path().join("x/y/z"), KIND).unwrap());
    assert_eq!(names(home.path()), ["out"]);
}

#[test]
fn the_second_of_two_is_refused() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    let first = StagedFolder::create(&target, KIND).unwrap();
    let said = StagedFolder::create(&target, KIND).unwrap_err().to_string();
    assert!(said.contains("out: in use by ") && said.contains("solution, process"), "{said}");
    fs::write(first.join("report.json"), "new").unwrap();
    first.commit().unwrap();
    assert_eq!(names(home.path()), ["out"]);
}

/// Killed before its end, or after the exchange and before the earlier output was deleted.
#[test]
fn the_next_run_cleans_up() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("out");
    write(&target, "old").unwrap();
    let at = |name: &str| home.path().join(name);
    fs::rename(&target, at(".out.partial-abc123")).unwrap();
    write(&target, "new").unwrap();
    assert_eq!(names(home.path()), ["out"]);
    let mut staged = StagedFolder::create(&target, KIND).unwrap();
    let _ = staged.partial.take().unwrap().keep();
    drop(staged);
    assert_eq!(names(home.path()).len(), 2);
    write(&at("other"), "new").unwrap();
    assert_eq!(names(home.path()), ["other", "out"]);
}

#[test]
fn long_names_work() {
    let home = tempfile::tempdir().unwrap();
    let target = home.path().join("n".repeat(250));
    write(&target, "old").unwrap();
    write(&target, "new").unwrap();
    assert_eq!(names(home.path()).len(), 1);
}
