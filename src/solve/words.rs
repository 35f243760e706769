//! Lists in sentences.

/// Names that are read at a glance.
const FEW: usize = 12;

/// "0, 1 and 2"; "0, 1, 2 and 61 others" where they are many.
pub(crate) fn few(mut names: Vec<String>) -> String {
    if names.len() > FEW {
        let others = format!("{} others", names.len() - (FEW - 2));
        names.truncate(FEW - 2);
        names.push(others);
    }
    in_words(&names)
}

/// "1, 2 and 3".
pub(crate) fn in_words(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
