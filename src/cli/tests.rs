use super::*;
use clap::CommandFactory;

#[test]
fn the_command_line_is_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn every_command_has_an_example() {
    for command in Cli::command().get_subcommands() {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let example = format!("weavelight {}", command.get_name());
        assert!(
            help.starts_with("Example:") && help.contains(&example),
            "{}: {help}",
            command.get_name()
        );
    }
}

#[test]
fn calls_are_understood_or_refused() {
    let check = |call: &str, understood: bool| {
        let found = Cli::try_parse_from(call.split_whitespace());
        assert_eq!(
            found.is_ok(),
            understood,
            "{call}: {:?}",
            found.err().map(|error| error.to_string())
        );
    };
    check("weavelight compare a.exr b.exr --json", true);
    check("weavelight --json compare a.exr b.exr --kind normal --mask m.png", true);
    check("weavelight compare a.exr", false);
    check("weavelight compare a.exr b.exr --kind height", false);
    check("weavelight import --lights l.lp --out s", true);
    check(
        "weavelight import --lights l.txt a.png b.png c.png --out s --encoding srgb --mask m.png",
        true,
    );
    check("weavelight import a.png --out s", false);
    check(
        "weavelight solve s --calibration c --out m --method least-squares --undistort --normal-y down",
        true,
    );
    check("weavelight solve s --calibration c --out m --method best", false);
    check("weavelight solve s --out m", false);
    check("weavelight solve s --calibration c --out m --threads 0", false);
    check("weavelight bench", true);
    check(
        "weavelight bench --quick --curves --set a=s,s/calibration,n.exr --set b=t,c,n.exr",
        true,
    );
    check("weavelight bench --no-fabrics --set a=s,c", false);
    check("weavelight bench --set s,c,n.exr", false);
    check("weavelight bench --set a=s,,n.exr", false);
    check("weavelight demo", true);
    check("weavelight demo --out d --size 64x48", true);
    check("weavelight demo --size big", false);
    check(
        "weavelight simulate --out d --preset knit --size 64x48 --seed 3 --only swatch,white-flat",
        true,
    );
    check(
        "weavelight simulate --out d --swapped 3 7 --drift -0.1 --swatch-mm 90x60 --noiseless",
        true,
    );
    check("weavelight simulate --out d --preset felt", false);
    check("weavelight simulate --out d --only everything", false);
    check("weavelight simulate --preset knit", false);
    check(
        "weavelight scan --rig r.toml --out s --name N --thickness-mm 1 --exposure-s 0.5 --resume",
        true,
    );
    check("weavelight scan --rig r.toml --dry-run --bracket 0.25,4", true);
    check("weavelight scan --rig r.toml --preview --light 3", true);
    check("weavelight scan --rig r.toml", false);
    check("weavelight scan --out s", false);
    check("weavelight scan --rig r.toml --out s --thickness-mm -1", false);
    check("weavelight doctor", true);
    check("weavelight gui", true);
    check("weavelight fly", false);
}
