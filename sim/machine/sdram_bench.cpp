// The board round a Verilated MemorySystem: a clock, an SDRAM, and a place for the pixels.
//
// Driven a frame at a time through the C functions at the end, which are those of bench.cpp; see sdram_bench.py.

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "Vcomponent.h"
#include "bench.h"
#include "sdram_chip.h"
#include "verilated.h"

namespace {

constexpr uint32_t num_words = 1 << 23, frame_stride = 1024;

struct Bench {
    VerilatedContext context;
    std::unique_ptr<Vcomponent> chip;
    sdram::Chip memory;
    uint64_t words_read[5] = {};
    uint32_t next_base = 0, bases[5] = {};
    uint64_t cycle = 0;
    Watch watch;
    uint16_t dq = 0;
    volatile bool interrupted = false;

    Bench(int sheet, double period) : memory(sdram::datasheets[sheet], period) {
        chip = std::make_unique<Vcomponent>(&context);
        chip->rst = 1;
        chip->pixel_ready = 1;
        for (int number = 0; number < 2; ++number) tick();
        chip->rst = 0;
        // The memory takes its time after power-up.
        while (!chip->ready && cycle < 1000000) tick();
    }

    ~Bench() { chip->final(); }

    // The falling edge comes first: it is when the chip's logic sees what was set since the last rising edge.
    void tick() {
        chip->pins_dq_i = dq;
        chip->clk = 0;
        chip->eval();
        dq = memory.edge({bool(chip->pins_cke), bool(chip->pins_cs_n), bool(chip->pins_ras_n), bool(chip->pins_cas_n),
                          bool(chip->pins_we_n), bool(chip->pins_dq_oe), chip->pins_ba, chip->pins_a, chip->pins_dqm,
                          chip->pins_dq_o});
        chip->clk = 1;
        chip->eval();
        ++cycle;
    }

    // From word ``at`` on
    void fill(uint32_t at, const uint32_t* words, uint64_t count) {
        for (uint64_t number = 0; number < count; ++number, ++at) {
            size_t place = sdram::Chip::place(at >> 8 & 3, at >> 10, (at & 255) << 1);
            memory.contents[place] = uint16_t(words[number]);
            memory.contents[place + 1] = uint16_t(words[number] >> 16);
        }
    }

    Status run(uint64_t max_cycles, uint64_t hang_cycles, uint32_t coord_width, uint32_t thread_width, uint32_t width,
               uint32_t height, uint32_t pixel_words, uint32_t* pixels, uint64_t* written, uint64_t* begun,
               uint32_t num_packets) {
        uint64_t end = cycle + max_cycles, first = cycle;
        uint32_t packets = 0;
        watch.quiet_since = cycle;
        chip->start = 1;
        tick();
        chip->start = 0;
        while (!chip->ready) {
            if (cycle >= end) return OUT_OF_CYCLES;
            if (interrupted) return INTERRUPTED;
            if (memory.violations) return VIOLATION;
            watch.threads(chip->probe, cycle, cycle - first, thread_width, begun, num_packets, packets);
            if (chip->pixel_valid &&
                !watch.pixel(chip->pixel_payload, cycle, cycle - first, coord_width, width, height, pixel_words, pixels,
                             written))
                return BAD_PIXEL;
            for (int number = 0; number < 5; ++number) words_read[number] += chip->delivered >> number & 1;
            if (cycle - watch.quiet_since > hang_cycles) return HUNG;
            tick();
        }
        // The last words are on their way to the pins.
        for (int number = 0; number < 8; ++number) tick();
        return DONE;
    }
};

}  // namespace

// Verilator's own would end the process.
void vl_stop(const char*, int, const char*) { throw AssertionFailed{}; }

extern "C" {

Bench* bench_new(int32_t sheet, double period) { return new Bench(sheet, period); }

void bench_delete(Bench* bench) { delete bench; }

// Regions follow each other behind the picture. Returns whether there is room.
int32_t bench_memory(Bench* bench, int32_t number, const uint32_t* words, uint64_t count, uint32_t line_words) {
    if (!bench->next_base) bench->next_base = frame_stride * 1024;
    uint32_t base = bench->next_base;
    if (base + count > num_words) return 0;
    bench->next_base = uint32_t((base + count + 15) / 16 * 16);
    bench->fill(base, words, count);
    switch (number) {
    case 0: bench->chip->nodes_base = base / 16; break;
    case 1: bench->chip->lists_base = base / 16; break;
    case 2: bench->chip->matrices_base = base / 16; break;
    case 3: bench->chip->shading_base = base / 16; break;
#if BENCH_TEXTURES
    case 4: bench->chip->textures_base = base / 16; break;
#endif
    }
    return 1;
}

void bench_picture(Bench* bench, const uint32_t* camera, uint32_t root, uint32_t width, uint32_t height,
                   uint32_t background) {
    assign(bench->chip->camera, camera);
    bench->chip->root = root;
    bench->chip->width = width;
    bench->chip->height = height;
    bench->chip->background = background;
}

int32_t bench_run(Bench* bench, uint64_t max_cycles, uint64_t hang_cycles, uint32_t coord_width,
                  uint32_t thread_width, uint32_t width, uint32_t height, uint32_t pixel_words, uint32_t* pixels,
                  uint64_t* written, uint64_t* begun, uint32_t num_packets) {
    try {
        return bench->run(max_cycles, hang_cycles, coord_width, thread_width, width, height, pixel_words, pixels,
                          written, begun, num_packets);
    } catch (const AssertionFailed&) {
        return ASSERTION;
    }
}

void bench_interrupt(Bench* bench) { bench->interrupted = true; }

uint64_t bench_cycle(Bench* bench) { return bench->cycle; }

uint64_t bench_words_read(Bench* bench, int32_t number) { return bench->words_read[number]; }

void bench_counters(Bench* bench, uint32_t* counters, uint32_t count) {
    for (uint32_t number = 0; number < count; ++number) counters[number] = word(bench->chip->counters, number);
}

void bench_threads(Bench* bench, int32_t* unit, uint64_t* cycle) {
    std::memcpy(unit, bench->watch.last_unit, sizeof bench->watch.last_unit);
    std::memcpy(cycle, bench->watch.last_entry, sizeof bench->watch.last_entry);
}

// The colours in the memory, as the display would show them
void bench_picture_words(Bench* bench, uint32_t width, uint32_t height, uint32_t* words) {
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) *words++ = bench->memory.word(y * frame_stride + x);
}

uint64_t bench_sdram(Bench* bench, int32_t what) {
    const sdram::Chip& memory = bench->memory;
    const uint64_t counts[] = {memory.data_cycles, memory.refreshes, memory.activations, memory.reads, memory.writes,
                               memory.violations};
    return counts[what];
}

const char* bench_violation(Bench* bench) { return bench->memory.first_violation.c_str(); }
}
