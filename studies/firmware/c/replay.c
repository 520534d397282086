
/* --- a program to try it: cc -std=c99 -DNOTCHBEND_MAIN ${name}.c -lm && ./a.out < ${name}_test.csv -------------------
   Standard input: rows whose first number is a reference, deg; the second, if any, a drive to compare with. Lines that
   do not begin with a number are skipped. With the argument "observe" the first number is a drive, the second an angle. */

#ifdef NOTCHBEND_MAIN
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int count, char **words)
{
    const int observes = count > 1 && strcmp(words[1], "observe") == 0;
    char line[256], *end, *more;
    double largest = 0;
    long compared = 0;
    notchbend_state state;
    notchbend_init(&state);
    puts(observes ? "drive_${unit},angle_deg,limited" : "reference_deg,drive_${unit},limited");
    while (fgets(line, sizeof line, stdin)) {
        double given = strtod(line, &end), found, expected;
        if (end == line)
            continue;
        found = observes ? (double)notchbend_observe(&state, (real)given) : (double)notchbend_step(&state, (real)given);
        printf("%.17g,%.17g,%u\n", given, found, state.limited);
        if (*end != ',')
            continue;
        expected = strtod(end + 1, &more);
        if (more == end + 1)
            continue;
        compared++;
        if (found - expected > largest || expected - found > largest)
            largest = found > expected ? found - expected : expected - found;
    }
    if (compared)
        (void)fprintf(stderr, "largest difference in %ld rows: %.3g %s\n", compared, largest, observes ? "deg" : "${unit}");
    return 0;
}
#endif
