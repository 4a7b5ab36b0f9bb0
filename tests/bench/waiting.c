/* Writes when each call of MPI that may wait begins and ends, by MPI's own profiling interface; `waiting.py` loads this
 * before MPI and reads TALUS_TRACE.RANK: rows of (kind, begin, end), the times in s on the clock that ranks of one
 * machine share. */
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum
{
  CAPACITY = 1 << 20
};
static double rows[CAPACITY][3];
static size_t count = 0;

static double now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int note(double kind, double begin, int result)
{
  if (count < CAPACITY)
  {
    rows[count][0] = kind;
    rows[count][1] = begin;
    rows[count++][2] = now();
  }
  return result;
}

int MPI_Barrier(MPI_Comm comm)
{
  const double begin = now();
  return note(0, begin, PMPI_Barrier(comm));
}

int MPI_Waitall(int n, MPI_Request* requests, MPI_Status* statuses)
{
  const double begin = now();
  return note(1, begin, PMPI_Waitall(n, requests, statuses));
}

int MPI_Allreduce(const void* send, void* receive, int n, MPI_Datatype type, MPI_Op op, MPI_Comm comm)
{
  const double begin = now();
  return note(2, begin, PMPI_Allreduce(send, receive, n, type, op, comm));
}

int MPI_Finalize(void)
{
  int rank;
  char name[1024];
  PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
  snprintf(name, sizeof name, "%s.%d", getenv("TALUS_TRACE"), rank);
  FILE* file = fopen(name, "wb");
  if (file == NULL || fwrite(rows, sizeof rows[0], count, file) != count || fclose(file) != 0)
    fprintf(stderr, "cannot write %s\n", name);
  return PMPI_Finalize();
}
