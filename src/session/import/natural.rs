use std::cmp::Ordering;

/// Natural order: runs of digits compare as numbers, so that `gray.2` stands before `gray.10`. Our own, because the crates round
/// digits to a float: time stamps of 17 digits would come in any order.
pub(super) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut rest_a, mut rest_b) = (a, b);
    while !rest_a.is_empty() && !rest_b.is_empty() {
        let (run_a, after_a) = first_run(rest_a);
        let (run_b, after_b) = first_run(rest_b);
        let order = if is_number(run_a) && is_number(run_b) {
            by_value(run_a, run_b)
        } else {
            run_a.cmp(run_b)
        };
        if order != Ordering::Equal {
            return order;
        }
        (rest_a, rest_b) = (after_a, after_b);
    }
    // Equal as numbers but written differently, as 01 and 1: any order, but always the same one.
    rest_a.len().cmp(&rest_b.len()).then_with(|| a.cmp(b))
}

/// The leading run of digits, or of anything else.
fn first_run(text: &str) -> (&str, &str) {
    let digits = is_number(text);
    let end = text.find(|letter: char| letter.is_ascii_digit() != digits).unwrap_or(text.len());
    text.split_at(end)
}

fn is_number(text: &str) -> bool {
    text.starts_with(|letter: char| letter.is_ascii_digit())
}

/// Any number of digits: compared without leading zeros, by length, then digit by digit.
fn by_value(a: &str, b: &str) -> Ordering {
    let (a, b) = (a.trim_start_matches('0'), b.trim_start_matches('0'));
    a.len().cmp(&b.len()).then_with(|| a.cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_as_numbers() {
        let check = |sorted: &[&str]| {
            let mut found = sorted.to_vec();
            found.reverse();
            found.sort_by(|a, b| natural_order(a, b));
            assert_eq!(found, sorted);
        };
        check(&["gray.0.png", "gray.2.png", "gray.10.png", "gray.11.png"]);
        check(&["a", "a1", "a1b", "a2", "b"]);
        check(&["01.png", "1.png", "2.png", "002x.png"]);
        check(&[
            "f99999999999999999999998",
            "f99999999999999999999999",
            "f100000000000000000000000",
        ]);
        check(&["é1", "é02", "é10"]);
        check(&["", "0", "1"]);
    }
}
