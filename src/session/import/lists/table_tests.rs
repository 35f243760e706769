use super::*;

fn numbered(text: &str) -> Vec<Numbered> {
    text.lines().enumerate().map(|(k, line)| (k + 1, line.trim().to_owned())).collect()
}

/// Names and numbers of a line.
type Parsed = (Vec<String>, Vec<f64>);

fn parsed(text: &str) -> Result<Vec<Parsed>, String> {
    let table =
        read(Path::new("l"), &numbered(text), 3, None).map_err(|error| error.to_string())?;
    Ok(table.rows.into_iter().map(|row| (row.names, row.values)).collect())
}

/// Every line of `text` means a picture of this name and (0.5, -0.25, 0.75).
fn check(text: &str, names: &[&str]) {
    let rows = parsed(text).unwrap_or_else(|error| panic!("{text:?}: {error}"));
    assert_eq!(rows.len(), names.len(), "{text:?}");
    for ((found, values), name) in rows.iter().zip(names) {
        assert_eq!(values, &[0.5, -0.25, 0.75], "{text:?}");
        if name.is_empty() {
            assert!(found.is_empty(), "{text:?}: {found:?}");
        } else {
            assert!(found.iter().any(|candidate| candidate == name), "{text:?}: {found:?}");
        }
    }
}

#[test]
fn every_way_to_write_a_line_means_the_same() {
    for line in [
        "a.png 0.5 -0.25 0.75",
        "\"a.png\" 0.5 -0.25 0.75",
        "'a.png' 0.5 -0.25 0.75",
        "\u{201c}a.png\u{201d} 0.5 -0.25 0.75",
        "a.png 0,5 -0,25 0,75",
        "a.png\t0,5\t-0,25\t0,75",
        "a.png;0,5;-0,25;0,75",
        "a.png; 0.5; -0.25; 0.75;",
        "a.png,0.5,-0.25,0.75",
        "a.png, 0.5, -0.25, 0.75",
        "a.png, 0,5, -0,25, 0,75",
        "\"a.png\",\"0,5\",\"-0,25\",\"0,75\"",
        "a.png 5e-1 \u{2212}.25 +0.75",
        "1 a.png 0.5 -0.25 0.75",
        "1. a.png 0.5 -0.25 0.75",
        "1;a.png;0,5;-0,25;0,75",
        "1,\"a.png\",0.5,-0.25,0.75",
        "a.png 0.5 -0.25 0.75 1.0",
        "a.png 0.5 -0.25 0.75 # the top one",
        "a.png: 0.5 -0.25 0.75",
        "0.5 -0.25 0.75 a.png",
        "1 0.5 -0.25 0.75 a.png",
    ] {
        check(line, &["a.png"]);
        check(&format!("name x y z\n{line}"), &["a.png"]);
        check(&format!("# note\n% note\n// note\n; note\n1\n{line}"), &["a.png"]);
    }
}

#[test]
fn names_keep_what_they_are_made_of() {
    for name in [
        "gray 0.png",
        "gray  0.png",
        "gray,0.png",
        "gray, 0.png",
        "50% #1.png",
        "o'brien 1.png",
        "C:\\my pictures\\a b.tif",
        "frame 001 0.5 2.png",
        "a;b.png",
        "%1.png",
        "r\u{e9}sum\u{e9}.NEF",
        "no-extension",
    ] {
        check(&format!("{name} 0.5 -0.25 0.75"), &[name]);
        check(&format!("\"{name}\" 0.5 -0.25 0.75"), &[name]);
        check(&format!("\"{name}\";0,5;-0,25;0,75"), &[name]);
        check(&format!("\"{name}\",0.5,-0.25,0.75"), &[name]);
        check(&format!("7\t\"{name}\"\t0.5\t-0.25\t0.75"), &[name]);
    }
    check("\"say \"\"a\"\".png\" 0.5 -0.25 0.75", &["say \"a\".png"]);
}

#[test]
fn a_column_of_numbers_before_the_direction_counts_the_lines_or_is_refused() {
    check("1 0.5 -0.25 0.75\n2 0.5 -0.25 0.75\n3 0.5 -0.25 0.75", &["", "", ""]);
    check("0;0,5;-0,25;0,75\n1;0,5;-0,25;0,75", &["", ""]);
    for text in [
        "7 0.5 -0.25 0.75",
        "0 0 1 0\n0 1 1 0",
        "1 0.5 -0.25 0.75\n3 0.5 -0.25 0.75",
        "0.5 -0.25 0.75 1 1",
        "a.png,0,5,0,25,0,75",
        "a.png 0.5 -0.25",
        "a.png 0.5 nan 0.75",
    ] {
        let error = parsed(text).unwrap_err();
        assert!(error.contains("is not 3 finite numbers; correct this line"), "{error}");
    }
    let error = parsed("a.png 0 0 1\nb.png 0 x 1\n").unwrap_err();
    assert!(error.starts_with("l:2: \"b.png 0 x 1\""), "{error}");
}

#[test]
fn one_number_a_line() {
    let values = |text: &str| -> Vec<f64> {
        let table = read(Path::new("l"), &numbered(text), 1, Some(3)).unwrap();
        table.rows.iter().map(|row| row.values[0]).collect()
    };
    assert_eq!(values("1\n2\n3"), [1.0, 2.0, 3.0]);
    assert_eq!(values("3\n1,5\n2\n3"), [1.5, 2.0, 3.0]);
    assert_eq!(values("2\n1\n1"), [2.0, 1.0, 1.0]);
    assert_eq!(values("a.png 1.5\nb.png 2"), [1.5, 2.0]);
}

#[test]
fn names_alone() {
    let found = |text: &str, count| -> Vec<Vec<String>> {
        read_names(&numbered(text), count).into_iter().map(|(_, names)| names).collect()
    };
    assert_eq!(found("a 1.png\n\"b.png\"\n# c\n", 2), [["a 1.png"], ["b.png"]]);
    assert_eq!(found("2\n1 a.png\n2 b.png", 2), [["1 a.png", "a.png"], ["2 b.png", "b.png"]]);
}
