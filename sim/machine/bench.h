// What the boards round Verilated chips have in common: why a run ends, where threads are, and the pixels.

#pragma once

#include <cstdint>

#include "common.h"

enum Status : int32_t {
    DONE = 0, HUNG = 1, OUT_OF_CYCLES = 2, BAD_ADDRESS = 3, BAD_PIXEL = 4, INTERRUPTED = 5, ASSERTION = 6, VIOLATION = 7
};

// Which unit each thread was last taken in by, and when; and the pixels that leave the chip.
struct Watch {
    uint64_t last_entry[64 * BENCH_PIPELINES] = {};
    int32_t last_unit[64 * BENCH_PIPELINES];
    uint64_t quiet_since = 0;

    Watch() {
        for (auto& unit : last_unit) unit = -1;
    }

    // Notes what moves in this cycle, ``since`` cycles after the picture was begun.
    template <class Probe>
    void threads(const Probe& probe, uint64_t cycle, uint64_t since, uint32_t thread_width, uint64_t* begun,
                 uint32_t num_packets, uint32_t& packets) {
        for (int place = 0; place < BENCH_UNITS * BENCH_PIPELINES; ++place) {
            uint32_t entry = field(probe, place * (thread_width + 1), thread_width + 1);
            if (!(entry & 1)) continue;
            int unit = place % BENCH_UNITS, thread = 64 * (place / BENCH_UNITS) + (entry >> 1);
            last_unit[thread] = unit;
            last_entry[thread] = quiet_since = cycle;
            if (unit == 0 && packets < num_packets) begun[packets++] = since;
            if (unit == BENCH_UNITS - 1) last_unit[thread] = -1;
        }
    }

    // Keeps a pixel; returns whether it is inside of the picture.
    template <class Payload>
    bool pixel(const Payload& payload, uint64_t cycle, uint64_t since, uint32_t coord_width, uint32_t width,
               uint32_t height, uint32_t pixel_words, uint32_t* pixels, uint64_t* written) {
        uint32_t x = field(payload, 0, coord_width), y = field(payload, coord_width, coord_width);
        if (x >= width || y >= height) return false;
        uint64_t place = uint64_t(y) * width + x;
        for (uint32_t number = 0; number < pixel_words; ++number)
            pixels[place * pixel_words + number] = word(payload, number);
        written[place] = since;
        quiet_since = cycle;
        return true;
    }
};
