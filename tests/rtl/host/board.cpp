// A HostPort with a memory that takes its time, driven by bytes.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <vector>

#include "Vcomponent.h"
#include "common.h"
#include "verilated.h"

namespace {

struct Write {
    uint32_t address, word;
};

// After so many cycles in which nothing comes or goes, nothing will.
constexpr int quiet_cycles = 300;

struct Board {
    std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
    std::unique_ptr<Vcomponent> dut = std::make_unique<Vcomponent>(context.get());
    Random random;
    std::vector<uint32_t> memory;
    // Words taken, which become visible when ``written`` rises.
    std::vector<Write> taken, done;
    uint32_t flush_in = 0, data_in = 0, address = 0, starts = 0, errors = 0;
    uint64_t cycles = 0, written = 0;
    uint8_t last_byte = 0xC0;
    int64_t reset_in = -1;

    Board(uint64_t seed, uint32_t num_words) : random{seed}, memory(num_words) {
        dut->clk = dut->rst = 0;
        dut->written = 1;
        dut->eval();
    }

    // One cycle; returns whether anything moves.
    bool cycle(const uint8_t* byte, std::vector<uint8_t>& answer) {
        bool resets = reset_in == 0;
        if (reset_in >= 0) --reset_in;
        dut->rst = resets;
        dut->i_valid = byte != nullptr;
        dut->i_payload = byte ? *byte : random() & 255;
        dut->o_ready = random.below(3) != 0;
        dut->write_ready = random.below(3) != 0;
        dut->request_ready = data_in == 0 && random.below(3) != 0;
        dut->data_valid = data_in == 1;
        dut->data_payload = data_in == 1 ? memory[address] : random();
        if (flush_in == 1) {
            for (const Write& each : taken) memory[each.address] = each.word, done.push_back(each);
            taken.clear();
        }
        if (flush_in) --flush_in;
        dut->written = taken.empty();
        dut->eval();
        bool moves = byte || data_in || flush_in || !taken.empty();
        if (data_in) --data_in;
        if (dut->o_valid && dut->o_ready) {
            // An answer begins with END behind the last one's: all that was asked for is then done.
            if (dut->o_payload == 0xC0 && last_byte == 0xC0 && !taken.empty()) ++errors;
            last_byte = dut->o_payload;
            answer.push_back(dut->o_payload), moves = true;
        }
        if (dut->write_valid && dut->write_ready) {
            uint64_t payload = dut->write_payload;
            uint32_t where = payload & ((1u << WORD_WIDTH) - 1), mask = payload >> (WORD_WIDTH + 32) & 15;
            if (where >= memory.size() || mask != 15) ++errors;
            else taken.push_back({where, uint32_t(payload >> WORD_WIDTH)});
            flush_in = 1 + random.below(100);
            ++written;
            moves = true;
        }
        if (dut->request_valid && dut->request_ready) {
            address = dut->request_payload;
            if (address >= memory.size()) ++errors, address = 0;
            data_in = 1 + random.below(30);
            moves = true;
        }
        if (dut->start) {
            ++starts;
            if (!dut->ready) ++errors;
        }
        dut->clk = 1;
        dut->eval();
        dut->clk = 0;
        dut->eval();
        if (resets) data_in = 0, last_byte = 0xC0;
        ++cycles;
        return moves;
    }
};

}  // namespace

void vl_stop(const char*, int, const char*) { throw AssertionFailed{}; }

extern "C" {

Board* board_new(uint64_t seed, uint32_t num_words) { return new Board(seed, num_words); }

void board_delete(Board* board) { delete board; }

// Bytes come with random gaps; returns how many bytes are answered, -1 if an assertion of the hardware fails.
int64_t board_receive(Board* board, const uint8_t* bytes, uint32_t count, uint8_t* answer, uint32_t most) {
    std::vector<uint8_t> answered;
    // Never so fast that a frame is there before the last answer's end, as on a wire.
    uint32_t gap = 3 + board->random.below(5);
    try {
        for (uint32_t place = 0; place < count;) {
            bool sends = board->random.below(gap) == 0;
            board->cycle(sends ? bytes + place : nullptr, answered);
            place += sends;
        }
        for (int quiet = 0; quiet < quiet_cycles;) quiet = board->cycle(nullptr, answered) ? 0 : quiet + 1;
    } catch (AssertionFailed&) {
        return -1;
    }
    if (answered.size() > most) return -1;
    std::memcpy(answer, answered.data(), answered.size());
    return int64_t(answered.size());
}

void board_reset_in(Board* board, uint32_t cycles) { board->reset_in = cycles; }

void board_set(Board* board, uint32_t ready, const uint32_t* values, uint32_t num_values) {
    board->dut->ready = ready;
    for (uint32_t number = 0; number < num_values; ++number) board->dut->values[number] = values[number];
    board->dut->eval();
}

void board_registers(Board* board, uint32_t* registers, uint32_t count) {
    for (uint32_t number = 0; number < count; ++number) registers[number] = board->dut->registers[number];
}

// Words written since the last time, as pairs of address and word; returns how many, at most so many.
uint32_t board_written(Board* board, uint32_t* pairs, uint32_t most) {
    uint32_t count = uint32_t(std::min<size_t>(most, board->done.size()));
    for (uint32_t number = 0; number < count; ++number)
        pairs[2 * number] = board->done[number].address, pairs[2 * number + 1] = board->done[number].word;
    board->done.erase(board->done.begin(), board->done.begin() + count);
    return count;
}

void board_counts(Board* board, uint64_t* counts) {
    counts[0] = board->cycles, counts[1] = board->starts, counts[2] = board->errors;
    counts[3] = board->reset_in >= 0, counts[4] = board->written;
}
}
