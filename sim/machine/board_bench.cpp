// The pins of a board round a Verilated Top: an oscillator for each clock, an SDRAM, a serial cable and a monitor's.

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "Vcomponent.h"
#include "common.h"
#include "sdram_chip.h"
#include "verilated.h"

namespace {

enum Status : int32_t { DONE = 0, ASSERTION = 1, VIOLATION = 2 };

// A byte a time to the chip, and bytes from it, as a UART of the same rate has them.
struct Cable {
    const uint32_t divisor;
    std::deque<uint8_t> to_chip, from_chip;

    explicit Cable(uint32_t divisor) : divisor(divisor) {}

    bool drive() {
        if (!left) {
            if (to_chip.empty()) return true;
            bits = 1u << 9 | uint32_t(to_chip.front()) << 1, left = 10 * divisor;
            to_chip.pop_front();
        }
        uint32_t place = 10 - (left + divisor - 1) / divisor;
        --left;
        return bits >> place & 1;
    }

    void sense(bool level) {
        if (!awaited) {
            // From the edge of the start bit to its middle
            if (before && !level) awaited = 10, wait = divisor / 2;
        } else if (--wait == 0) {
            wait = divisor;
            if (awaited > 1 && awaited < 10) byte = byte >> 1 | uint32_t(level) << 7;
            if (awaited == 1 && level) from_chip.push_back(uint8_t(byte));
            --awaited;
        }
        before = level;
    }

  private:
    uint32_t bits = 0, left = 0, byte = 0, awaited = 0, wait = 0;
    bool before = true;
};

struct Bench {
    VerilatedContext context;
    std::unique_ptr<Vcomponent> chip;
    std::optional<sdram::Chip> memory;
    Cable cable;
    // In picoseconds
    uint64_t sync_period, shift_period, next_sync = 0, next_shift = 0, shifts = 0, cycle = 0;
    // In the registers of the pins
    sdram::Pins out{false, true, true, true, true, false, 0, 0, 3, 0};
    uint16_t in = 0, dq = 0;
    uint8_t* pairs = nullptr;
    uint64_t pairs_left = 0;
    const sdram::Datasheet& sheet;

    Bench(int sheet, uint64_t sync_period, uint64_t shift_period, uint32_t divisor)
        : cable{divisor}, sync_period(sync_period), shift_period(shift_period), sheet(sdram::datasheets[sheet]) {
        chip = std::make_unique<Vcomponent>(&context);
        chip->rx = 1;
        memory.emplace(this->sheet, double(sync_period) / 1000);
        reset(4);
    }

    ~Bench() { chip->final(); }

    // The SDRAM is not reset, but not refreshed either, and rows stay open: as after power-up it must be initialised.
    // What was on its way to it when the reset came still arrives.
    void reset(int cycles) {
        chip->rst = chip->pixel_rst = chip->shift_rst = 1;
        for (int number = 0; number < cycles; ++number) tick();
        chip->rst = chip->pixel_rst = chip->shift_rst = 0;
        auto contents = std::move(memory->contents);
        memory.emplace(sheet, double(sync_period) / 1000);
        memory->contents = std::move(contents);
    }

    // The shift clock; the pixel clock rises between two of its edges.
    void shift() {
        if (shifts % 5 == 0) chip->pixel_clk = 1;
        if (shifts % 5 == 2) chip->pixel_clk = 0;
        chip->shift_clk = 0;
        chip->eval();
        if (pairs_left) *pairs++ = chip->pairs, --pairs_left;
        chip->shift_clk = 1;
        chip->eval();
        ++shifts;
        next_shift += shift_period;
    }

    // The falling edge comes first: it is when the chip's logic sees what was set since the last rising edge.
    void tick() {
        while (next_shift <= next_sync) shift();
        chip->pins_dq_i = in;
        chip->rx = cable.drive();
        chip->clk = 0;
        chip->eval();
        cable.sense(chip->tx);
        in = dq;
        dq = memory->edge(out);
        out = {bool(chip->pins_cke), bool(chip->pins_cs_n), bool(chip->pins_ras_n), bool(chip->pins_cas_n),
               bool(chip->pins_we_n), bool(chip->pins_dq_oe), chip->pins_ba, chip->pins_a, chip->pins_dqm,
               chip->pins_dq_o};
        chip->clk = 1;
        chip->eval();
        ++cycle;
        next_sync += sync_period;
    }
};

}  // namespace

// Verilator's own would end the process.
void vl_stop(const char*, int, const char*) { throw AssertionFailed{}; }

extern "C" {

Bench* bench_new(int32_t sheet, uint64_t sync_period, uint64_t shift_period, uint32_t divisor) {
    return new Bench(sheet, sync_period, shift_period, divisor);
}

void bench_delete(Bench* bench) { delete bench; }

void bench_reset(Bench* bench) { bench->reset(4); }

void bench_send(Bench* bench, const uint8_t* bytes, uint64_t count) {
    bench->cable.to_chip.insert(bench->cable.to_chip.end(), bytes, bytes + count);
}

// Up to so many cycles, until a byte has come.
int32_t bench_run(Bench* bench, uint64_t cycles, int32_t until_byte) {
    try {
        for (uint64_t end = bench->cycle + cycles; bench->cycle < end;) {
            bench->tick();
            if (bench->memory->violations) return VIOLATION;
            if (until_byte && !bench->cable.from_chip.empty()) break;
        }
    } catch (const AssertionFailed&) {
        return ASSERTION;
    }
    return DONE;
}

uint64_t bench_received(Bench* bench, uint8_t* bytes, uint64_t count) {
    auto& from = bench->cable.from_chip;
    uint64_t number = 0;
    for (; number < count && !from.empty(); from.pop_front()) bytes[number++] = from.front();
    return number;
}

// What the monitor's cable carries goes there from now on, a byte for each period of the shift clock.
void bench_watch(Bench* bench, uint8_t* pairs, uint64_t count) { bench->pairs = pairs, bench->pairs_left = count; }

uint64_t bench_unwatched(Bench* bench) { return bench->pairs_left; }

uint64_t bench_cycle(Bench* bench) { return bench->cycle; }

uint32_t bench_lamps(Bench* bench) { return bench->chip->lamps; }

const char* bench_violation(Bench* bench) { return bench->memory->first_violation.c_str(); }
}
