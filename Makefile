# make demo    simulate a rig, scan a swatch, solve it, and open the report's folder: the whole job, no hardware
# make test    every test
# make build   the release executables with every feature, in target/release
# make install   them, with desktop entry and icon, below PREFIX (~/.local)
# make firmware the light board's firmware, and the simulated board that tests run it in
# make thorough the tests whose tables run in part otherwise, whole
# make soak    light board and host for fifteen minutes over a bad wire
# make kills   the program killed two hundred times while it scans, at the simulated board
# make attacks mutated files, kills and errors at system calls, two processes on every output, by the thousand
# make scan-timing   wall time of a scan of full-size frames beside exposure and transfer
# make tether-timing the same through libgphoto2, with a camera that speaks PTP/IP
# make measurements   docs/measurements.md: every figure that README and docs state; QUICK=1 for a check, LONG=1 for all
# make bench   run time against error and against touching the bytes once; the window's frames
SHELL := /bin/bash
.DEFAULT_GOAL := build

LINKER_PACKAGES := gcc libc6-dev
# Chessboards are found by OpenCV; its bindings are generated with clang.
OPENCV_PACKAGES := g++ pkg-config clang libclang-dev libopencv-dev
# Tethered cameras are held by libgphoto2; its bindings are generated with clang.
TETHER_PACKAGES := pkg-config clang libclang-dev libgphoto2-dev
# A graphics processor in software: what the solve's shaders are tested on, and what the window's tests draw with.
VULKAN_PACKAGES := libvulkan1 mesa-vulkan-drivers
# The window.
WINDOW_PACKAGES := libxkbcommon-x11-0 libx11-xcb1 libxcursor1 libxi6 libxrandr2 xvfb xdotool xclip openbox imagemagick
# The light board's firmware, and the simulated processor that its tests run it in.
FIRMWARE_PACKAGES := make gcc-avr avr-libc binutils-avr arduino-core-avr libsimavr-dev libelf-dev

# Kills and errors at chosen system calls.
ATTACK_PACKAGES := strace

.PHONY: demo test thorough build install measurements bench soak kills attacks scan-timing tether-timing firmware packages-demo packages-all packages-firmware

packages-demo:
	@bash .ci/packages $(LINKER_PACKAGES)

packages-all:
	@bash .ci/packages $(LINKER_PACKAGES) $(OPENCV_PACKAGES) $(TETHER_PACKAGES) $(WINDOW_PACKAGES) $(VULKAN_PACKAGES) $(ATTACK_PACKAGES)

packages-firmware:
	@bash .ci/packages $(LINKER_PACKAGES) $(FIRMWARE_PACKAGES)

firmware: packages-firmware
	@$(MAKE) --no-print-directory -C firmware

demo: packages-demo
	cargo run --release --locked --quiet -- demo --out demo

# nextest where it is there: it runs the tests of several executables side by side. Tests fail where what they need is missing;
# what no package brings is looked for here, and passed over by name (tests/support/skip.rs).
test: packages-all firmware
	@skip=$$WEAVELIGHT_SKIP; \
	if [ ! -d "$${WEAVELIGHT_DATA:-../shared/data}" ]; then \
	    echo "No real pictures in $${WEAVELIGHT_DATA:-../shared/data}: their tests are skipped"; skip="$$skip,data"; fi; \
	if ! unshare --user --map-root-user --mount true 2> /dev/null; then \
	    echo "No namespaces for users: scans onto full disks are skipped"; skip="$$skip,unshare"; fi; \
	if ! unshare --mount true 2> /dev/null; then \
	    echo "No right to mount a disk: outputs onto full disks are skipped"; skip="$$skip,mount"; fi; \
	export WEAVELIGHT_SKIP=$$skip; \
	if cargo nextest --version >/dev/null 2>&1; then \
	    cargo nextest run --locked --workspace --all-features --no-fail-fast; status=$$?; \
	    .ci/slowest target/nextest/default/junit.xml; \
	    exit $$status; \
	else \
	    cargo test --locked --workspace --all-features --lib --bins --tests --no-fail-fast; \
	fi
	cargo test --locked --workspace --all-features --doc --quiet

# Every case of the tables of which `make test` runs a share.
thorough: packages-all firmware
	WEAVELIGHT_THOROUGH=1 cargo test --locked --workspace --all-features --test swatch --test calibration

build: packages-all
	cargo build --release --locked --workspace --all-features

PREFIX ?= $(HOME)/.local
install: build
	install -D -t $(PREFIX)/bin target/release/weavelight target/release/weavelight-app target/release/weavelight-tether
	install -D -m 644 -t $(PREFIX)/share/applications app/desktop/weavelight.desktop
	install -D -m 644 -t $(PREFIX)/share/icons/hicolor/64x64/apps app/desktop/weavelight.png

measurements: packages-all firmware
	.ci/measure

bench: packages-all
	cargo bench --locked --all-features
	cargo bench --locked -p weavelight-app --bench frame
	cargo run --release --locked --quiet --all-features -- bench --out bench --curves

# Fifteen minutes with the real firmware over a bad wire; make soak SOAK_S=60 for a short one.
SOAK_S ?= 900
soak: packages-all firmware
	WEAVELIGHT_SOAK_S=$(SOAK_S) cargo test --locked --release --test board -- --ignored --nocapture fifteen_minutes

# The program killed while it scans; make kills KILLS=20 for fewer.
KILLS ?= 200
kills: packages-all firmware
	WEAVELIGHT_KILLS=$(KILLS) cargo test --locked --release --test scan -- --ignored --nocapture two_hundred_kills

# Some twenty minutes; the numbers of tries can be given.
MUTATIONS ?= 5000
KILLS_PER_CALL ?= 20
ERRORS_PER_CALL ?= 25
PAIRS ?= 10
attacks: packages-all
	WEAVELIGHT_MUTATIONS=$(MUTATIONS) WEAVELIGHT_KILLS_PER_CALL=$(KILLS_PER_CALL) WEAVELIGHT_ERRORS_PER_CALL=$(ERRORS_PER_CALL) \
	    WEAVELIGHT_PAIRS=$(PAIRS) cargo test --locked --release --test attacks -- --nocapture

scan-timing: packages-all firmware
	cargo test --locked --release --test scan -- --ignored --nocapture ten_full_size_frames

tether-timing: packages-all firmware
	cargo test --locked --release -p weavelight-tether --all-features --test camera -- --ignored --nocapture ten_full_size_frames
