// The protocol of `plumbob verify` (docs/protocol.md) for C++17: nothing here needs to be changed.
#pragma once
#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>
#ifdef _WIN32
#include <io.h>
#define dup _dup
#define dup2 _dup2
#define fdopen _fdopen
#else
#include <unistd.h>
#endif

namespace plumbob {

// Where the answers go. What is printed on standard output, even before main, goes to the errors.
inline FILE* take_output() {
    std::fflush(stdout);
    FILE* answers = fdopen(dup(1), "wb");
    dup2(2, 1);
    return answers;
}
inline FILE* const answers = take_output();

struct Value {  // null is the number NaN
    double number = NAN;
    std::string text;
    std::vector<Value> items;
    std::map<std::string, Value> members;
};

class Parser {
  public:
    explicit Parser(const std::string& line) : at(line.c_str()) {}

    Value value() {
        Value out;
        skip();
        if (*at == '{') {
            list('}', [&] {
                std::string name = text();
                skip();
                expect(':');
                out.members[name] = value();
            });
        } else if (*at == '[') {
            list(']', [&] { out.items.push_back(value()); });
        } else if (*at == '"') {
            out.text = text();
        } else if (std::isalpha(static_cast<unsigned char>(*at))) {
            out.number = *at == 't' ? 1.0 : *at == 'f' ? 0.0 : NAN;
            while (std::isalpha(static_cast<unsigned char>(*at))) ++at;
        } else {
            char* end;
            out.number = std::strtod(at, &end);
            if (end == at) throw std::runtime_error("the request is no JSON");
            at = end;
        }
        return out;
    }

  private:
    const char* at;

    void skip() {
        while (*at == ' ' || *at == '\t' || *at == '\r') ++at;
    }

    void expect(char wanted) {
        if (*at != wanted) throw std::runtime_error("the request is no JSON");
        ++at;
    }

    template <class Item> void list(char end, Item item) {
        ++at;
        for (skip(); *at != end; skip()) {
            item();
            skip();
            if (*at != end) expect(','), skip();
        }
        ++at;
    }

    std::string text() {  // \uXXXX stays as it is: no request needs it
        std::string out;
        expect('"');
        for (; *at != '"'; ++at) {
            if (!*at) throw std::runtime_error("the request is no JSON");
            if (*at == '\\' && (at[1] == '"' || at[1] == '\\' || at[1] == '/')) ++at;
            out += *at;
        }
        ++at;
        return out;
    }
};

inline void read(const Value& from, double& to) { to = from.number; }
inline void read(const Value& from, float& to) { to = static_cast<float>(from.number); }
inline void read(const Value& from, int& to) { to = static_cast<int>(from.number); }
inline void read(const Value& from, bool& to) { to = from.number == 1.0; }
inline void read(const Value& from, std::string& to) { to = from.text; }
// Vectors x, y, z and quaternions w, x, y, z of glm and Eigen, if included above this file.
template <class To> void read_vector(const Value& from, To& to) {
    for (int i = 0; i < 3; ++i) read(from.items.at(i), to[i]);
}
template <class T> T number(const Value& from, int i) {
    return static_cast<T>(from.items.at(i).number);
}
#ifdef GLM_VERSION
template <class T, glm::qualifier Q> void read(const Value& from, glm::vec<3, T, Q>& to) {
    read_vector(from, to);
}
template <class T, glm::qualifier Q> void read(const Value& from, glm::qua<T, Q>& to) {
    to.w = number<T>(from, 0), to.x = number<T>(from, 1);
    to.y = number<T>(from, 2), to.z = number<T>(from, 3);
}
#endif
#ifdef EIGEN_WORLD_VERSION
template <class T> void read(const Value& from, Eigen::Matrix<T, 3, 1>& to) {
    read_vector(from, to);
}
template <class T> void read(const Value& from, Eigen::Quaternion<T>& to) {
    to = Eigen::Quaternion<T>(number<T>(from, 0), number<T>(from, 1), number<T>(from, 2),
                              number<T>(from, 3));
}
#endif
template <class T, std::size_t n> void read(const Value& from, std::array<T, n>& to) {
    for (std::size_t i = 0; i < n; ++i) read(from.items.at(i), to[i]);
}
template <class T> void read(const Value& from, std::vector<T>& to) {
    to.clear();
    for (const Value& item : from.items) {
        T one;
        read(item, one);
        to.push_back(one);
    }
}

inline std::string digits(const char* format, double number) {
    char out[32];
    std::snprintf(out, sizeof out, format, number);
    return std::isfinite(number) ? out : "null";
}
// Enough digits to read the same number back.
inline std::string write(double number) { return digits("%.17g", number); }
inline std::string write(float number) { return digits("%.9g", number); }
inline std::string write(int number) { return std::to_string(number); }
inline std::string write(bool truth) { return truth ? "true" : "false"; }
inline std::string write(const std::string& text) {
    std::string out = "\"";
    for (char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
    return out + '"';
}
template <class T> std::string joined(const std::vector<T>& numbers) {
    std::string out = "[";
    for (T one : numbers) out += (out.size() > 1 ? "," : "") + write(one);
    return out + ']';
}
#ifdef GLM_VERSION
template <class T, glm::qualifier Q> std::string write(const glm::vec<3, T, Q>& v) {
    return joined<T>({v.x, v.y, v.z});
}
template <class T, glm::qualifier Q> std::string write(const glm::qua<T, Q>& q) {
    return joined<T>({q.w, q.x, q.y, q.z});
}
#endif
#ifdef EIGEN_WORLD_VERSION
template <class T> std::string write(const Eigen::Matrix<T, 3, 1>& v) {
    return joined<T>({v.x(), v.y(), v.z()});
}
template <class T> std::string write(const Eigen::Quaternion<T>& q) {
    return joined<T>({q.w(), q.x(), q.y(), q.z()});
}
#endif
template <class List> std::string write(const List& list) {
    std::string out = "[";
    for (const auto& one : list) out += (out.size() > 1 ? "," : "") + write(one);
    return out + ']';
}

template <class T, class = void> struct is_read : std::false_type {};
template <class T>
struct is_read<T, std::void_t<decltype(read(std::declval<const Value&>(), std::declval<T&>()))>>
    : std::true_type {};

class Request {
  public:
    std::string task;

    explicit Request(Value value) : members(std::move(value.members)) {
        task = (*this)["task"].value.text;
    }

    bool has(const std::string& name) const { return members.count(name) > 0; }

    // A text that a request may lack, then empty.
    std::string text(const std::string& name) const {
        auto found = members.find(name);
        return found == members.end() ? "" : found->second.text;
    }

    // A field becomes what it is given to: double h = in["h"], or h = in["h"]; null is NaN.
    struct Field {
        const Value& value;
        // Nothing else that vectors and strings are assigned from: lists in braces, const char*.
        template <class T, std::enable_if_t<is_read<T>::value, int> = 0> operator T() const {
            T out;
            read(value, out);
            return out;
        }
    };
    Field operator[](const std::string& name) const {
        auto found = members.find(name);
        if (found == members.end()) throw std::runtime_error("the request has no " + name);
        return {found->second};
    }

  private:
    std::map<std::string, Value> members;
};

class Answer {
  public:
    std::string text;

    template <class T> void set(const std::string& name, const T& value) {
        text += ",\"" + name + "\":" + write(value);
    }

    // Call the solver, and set the time that it takes alone.
    template <class Call> void time(Call call) {
        auto start = std::chrono::steady_clock::now();
        call();
        std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        set("seconds", seconds.count());
    }
};

inline std::runtime_error missing(const std::string& what) {
    return std::runtime_error(what + " is not written yet");
}

inline bool next_line(std::string& line) {
    line.clear();
    int c;
    while ((c = std::getchar()) != EOF && c != '\n') line += static_cast<char>(c);
    return c != EOF || !line.empty();
}

// Answer every request until standard input ends; `greeting` holds members of a JSON object.
template <class Solve> int serve(std::string greeting, Solve solve) {
    std::replace(greeting.begin(), greeting.end(), '\n', ' ');  // an answer is one line
    for (std::string line; next_line(line);) {
        Answer answer;
        int id = -1;
        try {
            Request request(Parser(line).value());
            id = request["id"];
            if (request.task == "greeting")
                answer.text = ",\"protocol\":1," + greeting;
            else
                solve(request, answer);
        } catch (const std::exception& error) {
            answer.text = ",\"error\":" + write(std::string(error.what()));
        }
        std::fprintf(answers, "{\"id\":%d%s}\n", id, answer.text.c_str());
        std::fflush(answers);
    }
    return 0;
}

}  // namespace plumbob
