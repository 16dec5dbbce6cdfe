// Random traffic on all ports of an SdramMemory, checked word by word, with the SDRAM chip behind it.

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "Vcomponent.h"
#include "common.h"
#include "sdram_chip.h"
#include "verilated.h"

namespace {

constexpr uint32_t num_words = 1 << 23;

// What a source of traffic does. Rates are offers a cycle where it has none; a sequential one goes on where it was.
struct Source {
    double rate = 0;
    uint32_t sequential = 0, first = 0, count = num_words;
};

struct Expected {
    uint32_t address, word;
};

struct Reader {
    uint32_t words;
    Source source;
    std::deque<Expected> expected;
    uint32_t line = 0, next = 0;
    bool offers = false;
};

struct Writer {
    Source source;
    uint32_t address = 0, word = 0, mask = 0, next = 0;
    bool offers = false;
};

struct Counts {
    uint64_t accesses, cycles, errors, violations, refreshes, activations, read_words, written_words, shown_words,
        data_cycles, underruns, longest_wait;
};

struct Soak {
    VerilatedContext context;
    std::unique_ptr<Vcomponent> dut;
    sdram::Chip chip;
    Random random;
    std::vector<uint32_t> truth = std::vector<uint32_t>(num_words);
    // How many reads and writes of a word are under way
    std::vector<uint8_t> reading = std::vector<uint8_t>(num_words), writing = std::vector<uint8_t>(num_words);
    std::deque<uint32_t> recent;
    std::vector<Reader> readers;
    std::vector<Writer> writers;
    // Pixels a cycle, where the beam is, and how many pixels there are in a word
    double display_rate = 0, display_owed = 0;
    uint64_t display_from = 60000;
    uint32_t beam_x = 0, beam_y = 0, pixels_per_word = 1;
    bool wants_word = false;
    uint32_t display_first = 0, display_count = 0, display_at = 0;
    uint32_t ready_words = 0;
    Counts counts{};
    std::string first_error;
    std::vector<uint64_t> asked;
    uint64_t cycle = 0;
    uint16_t dq = 0;

    Soak(int sheet, double period, uint64_t seed, const uint32_t* words, int num_readers, int num_writers)
        : chip(sdram::datasheets[sheet], period), random{seed * 2 + 1} {
        dut = std::make_unique<Vcomponent>(&context);
        for (int number = 0; number < num_readers; ++number) {
            readers.emplace_back();
            readers.back().words = words[number];
        }
        asked.resize(num_readers);
        writers.resize(num_writers);
        for (uint32_t address = 0; address < num_words; ++address) {
            truth[address] = random();
            size_t at = sdram::Chip::place(address >> 8 & 3, address >> 10, (address & 255) << 1);
            chip.contents[at] = uint16_t(truth[address]);
            chip.contents[at + 1] = uint16_t(truth[address] >> 16);
        }
        dut->rst = 1;
        reset();
        reset();
        dut->rst = 0;
    }

    void fail(const std::string& text) {
        if (!counts.errors++) first_error = text + ", cycle " + std::to_string(cycle);
    }

    void edge() {
        sdram::Pins pins{bool(dut->pins_cke), bool(dut->pins_cs_n), bool(dut->pins_ras_n), bool(dut->pins_cas_n),
                         bool(dut->pins_we_n), bool(dut->pins_dq_oe), dut->pins_ba, dut->pins_a, dut->pins_dqm,
                         dut->pins_dq_o};
        dq = chip.edge(pins);
        dut->clk = 1;
        dut->eval();
        ++cycle;
    }

    void reset() {
        dut->clk = 0;
        dut->eval();
        edge();
    }

    uint32_t choose(const Source& source, uint32_t words, uint32_t& next) {
        uint32_t items = source.count / words;
        uint32_t item = source.sequential ? next : random.below(items);
        if (source.sequential) next = next + 1 == items ? 0 : next + 1;
        return source.first / words + item;
    }

    // What the memory puts out before an edge is taken there.
    void take(Reader& reader, uint64_t& since, bool accepted, bool data_valid, uint32_t data) {
        if (accepted) {
            reader.offers = false;
            ++counts.accesses;
        }
        if (!data_valid) return;
        if (reader.expected.empty()) return fail("a word that nobody asked for");
        const Expected& expected = reader.expected.front();
        if (data != expected.word) fail("word " + std::to_string(expected.address));
        --reading[expected.address];
        ++counts.read_words;
        reader.expected.pop_front();
        counts.longest_wait = std::max(counts.longest_wait, cycle - since);
        since = cycle;
    }

    template <class Valid, class Payload>
    void offer(Reader& reader, uint64_t& since, Valid& valid, Payload& payload) {
        if (reader.expected.empty()) since = cycle;
        if (!reader.offers && reader.source.rate > 0 && random.chance(reader.source.rate)) {
            uint32_t line = choose(reader.source, reader.words, reader.next), first = line * reader.words;
            bool free = true;
            for (uint32_t word = 0; word < reader.words; ++word) free &= !writing[first + word];
            if (free) {
                for (uint32_t word = 0; word < reader.words; ++word) {
                    ++reading[first + word];
                    reader.expected.push_back({first + word, truth[first + word]});
                }
                reader.line = line;
                reader.offers = true;
            }
        }
        valid = reader.offers;
        payload = reader.line;
    }

    void take(Writer& writer, bool accepted) {
        if (!accepted) return;
        writer.offers = false;
        ++counts.accesses, ++counts.written_words;
        recent.push_back(writer.address);
        // No more than these can still be on their way.
        if (recent.size() > 40) {
            --writing[recent.front()];
            recent.pop_front();
        }
    }

    template <class Valid, class Payload>
    void offer(Writer& writer, Valid& valid, Payload& payload) {
        if (!writer.offers && writer.source.rate > 0 && random.chance(writer.source.rate)) {
            uint32_t address = choose(writer.source, 1, writer.next);
            bool shown = address - display_first < display_count;
            if (!reading[address] && !writing[address] && !shown) {
                writer.address = address, writer.word = random();
                writer.mask = random.chance(0.75) ? 15 : random() & 15;
                uint32_t keep = 0;
                for (int byte = 0; byte < 4; ++byte)
                    if (!(writer.mask >> byte & 1)) keep |= 255u << 8 * byte;
                truth[address] = (truth[address] & keep) | (writer.word & ~keep);
                ++writing[address];
                writer.offers = true;
            }
        }
        valid = writer.offers;
        payload = QData(writer.address) | QData(writer.word) << 23 | QData(writer.mask) << 55;
    }

#if SOAK_DISPLAY
    void take_display() {
        if (!dut->display_word_valid || !dut->display_word_ready) return;
        if (dut->display_word_payload != truth[display_first + display_at]) fail("a word on the display");
        display_at = display_at + 1 == display_count ? 0 : display_at + 1;
        ++counts.shown_words;
        counts.accesses += counts.shown_words % 16 == 0;
        wants_word = false;
    }

    void offer_display() {
        dut->display_frame_valid = display_count > 0;
        dut->display_frame_payload = QData(display_first / 16) | QData(display_count / 16 - 1) << 19;
        // The display is switched on when its port has had time to fill.
        if (counts.shown_words == 0 && !wants_word) wants_word = dut->display_word_valid;
        if (cycle > display_from) display_owed += display_rate;
        if (display_owed >= 1) {
            display_owed -= 1;
            // 640x480 at 60 Hz: 800 by 525 pixels with their borders
            if (beam_x < 640 && beam_y < 480 && beam_x % pixels_per_word == 0) {
                counts.underruns += wants_word && counts.shown_words > 0;
                wants_word = true;
            }
            if (++beam_x == 800) {
                beam_x = 0;
                if (++beam_y == 525) beam_y = 0;
            }
        }
        dut->display_word_ready = wants_word;
    }
#endif

    void run(uint64_t accesses, uint64_t max_cycles) {
        uint64_t end = cycle + max_cycles, goal = counts.accesses + accesses;
        while (counts.accesses < goal && cycle < end && !counts.errors && !chip.violations) {
#define READER(place) offer(readers[place], asked[place], dut->r##place##_request_valid, dut->r##place##_request_payload);
#define WRITER(place) offer(writers[place], dut->write_##place##_valid, dut->write_##place##_payload);
            SOAK_PORTS
#undef READER
#undef WRITER
#if SOAK_DISPLAY
            offer_display();
#endif
            dut->pins_dq_i = dq;
            dut->clk = 0;
            dut->eval();
#define READER(place) \
    take(readers[place], asked[place], dut->r##place##_request_valid && dut->r##place##_request_ready, \
         dut->r##place##_data_valid, dut->r##place##_data_payload);
#define WRITER(place) take(writers[place], dut->write_##place##_valid && dut->write_##place##_ready);
            SOAK_PORTS
#if SOAK_DISPLAY
            take_display();
#endif
            edge();
        }
    }

    // All that is under way comes back, and what was written is in the chip.
    void finish() {
        for (Reader& reader : readers) reader.source.rate = 0;
        for (Writer& writer : writers) writer.source.rate = 0;
        run(uint64_t(1) << 62, 20000);
        for (Reader& reader : readers)
            if (!reader.expected.empty() || reader.offers) fail("words that never came");
        for (uint32_t address = 0; address < num_words; ++address)
            if (chip.word(address) != truth[address]) fail("word " + std::to_string(address) + " in the chip");
    }
};

}  // namespace

void vl_stop(const char*, int, const char*) { throw AssertionFailed{}; }

extern "C" {

Soak* soak_new(int sheet, double period, uint64_t seed, const uint32_t* words, int num_readers, int num_writers) {
    return new Soak(sheet, period, seed, words, num_readers, num_writers);
}

void soak_delete(Soak* soak) { delete soak; }

void soak_reader(Soak* soak, int number, double rate, uint32_t sequential, uint32_t first, uint32_t count) {
    soak->readers[number].source = {rate, sequential, first, count};
}

void soak_writer(Soak* soak, int number, double rate, uint32_t sequential, uint32_t first, uint32_t count) {
    soak->writers[number].source = {rate, sequential, first, count};
}

void soak_display(Soak* soak, double rate, uint32_t pixels_per_word, uint32_t first, uint32_t count) {
    soak->display_rate = rate;
    soak->pixels_per_word = pixels_per_word;
    soak->display_first = first;
    soak->display_count = count;
}

int soak_run(Soak* soak, uint64_t accesses, uint64_t max_cycles, int finish) {
    try {
        soak->run(accesses, max_cycles);
        if (finish) soak->finish();
        return 0;
    } catch (const AssertionFailed&) {
        return 1;
    }
}

void soak_counts(Soak* soak, Counts* counts) {
    soak->counts.cycles = soak->cycle;
    soak->counts.violations = soak->chip.violations;
    soak->counts.refreshes = soak->chip.refreshes;
    soak->counts.activations = soak->chip.activations;
    soak->counts.data_cycles = soak->chip.data_cycles;
    *counts = soak->counts;
}

void soak_damage(Soak* soak, uint32_t address) {
    soak->chip.contents[sdram::Chip::place(address >> 8 & 3, address >> 10, (address & 255) << 1)] ^= 1;
}

const char* soak_message(Soak* soak) {
    return soak->chip.violations ? soak->chip.first_violation.c_str() : soak->first_error.c_str();
}
}
