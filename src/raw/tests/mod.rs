mod builder;
mod dng;
mod encodings;
mod ljpeg;
mod mutations;
mod nef;
mod pictures;
mod tagged;
